// Takes the schemas of studies and sets from the documentation into the package: there is one text of each.
const fs = require("fs");
const path = require("path");

const from = path.join(__dirname, "..", "..", "docs", "schema");
const to = path.join(__dirname, "schemas");
fs.mkdirSync(to, { recursive: true });
for (const name of ["study.schema.json", "set.schema.json"]) {
  fs.copyFileSync(path.join(from, name), path.join(to, name));
}
for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) {
  fs.copyFileSync(path.join(__dirname, "..", "..", name), path.join(__dirname, name));
}
