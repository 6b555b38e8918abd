"""The specification. A package of its own name, because a library brings one called `tests` as well."""
