//! `hyd bench schema study|set`: the JSON Schema of a file that people write.

use crate::arguments::{Schema, SchemaKind};
use crate::{Failure, output};

/// Of studies.
const STUDY: &str = include_str!("../../docs/schema/study.schema.json");
/// Of sets.
const SET: &str = include_str!("../../docs/schema/set.schema.json");

/// Runs the verb.
pub(crate) fn schema(arguments: &Schema) -> Result<(), Failure> {
    output::print(match arguments.kind {
        SchemaKind::Study => STUDY,
        SchemaKind::Set => SET,
    })
}
