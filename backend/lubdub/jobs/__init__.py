"""The queue, the worker, and the sandboxed child that alone touches a stranger's file."""
