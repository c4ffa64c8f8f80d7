//! A model as a file: header, then the model, all checked before anything of it is used.
//!
//! Header: 8 bytes of magic, version of the format, number of the target, extensions of the processor that the code
//! uses, bytes of the rest, and a hash of the header before it and of the rest (64 bit: a variant of FNV-1a by Fowler,
//! Noll and Vo over words of 8 bytes, turned after each so that high bits reach low ones).  The hash tells damage, not
//! malice: who runs a file trusts it as he trusts a program.

use std::fmt;
use std::sync::Arc;

use crate::codec::{Input, Stored};
use crate::mapping::Code;
use crate::memory::Extents;
use crate::model::Model;
use crate::names::Names;
use crate::tangent::{SweepModel, TangentModel};
use crate::target::{self, Target};

/// First bytes of every payload.
pub const MAGIC: [u8; 8] = *b"hydmodel";
/// Version of the format; another one is refused.  A change of the stored types or of the positions in the table of
/// functions ([`crate::functions`]) is a new one.
pub const VERSION: u32 = 12;
/// Bytes before the model.
const HEADER: usize = 8 + 3 * 4 + 2 * 8;

/// Why bytes are not a model that can run here.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FormatError {
    /// They do not begin as a payload does.
    Foreign,
    /// They end too early, or go on.
    Length {
        /// Bytes that should follow the header.
        wanted: u64,
        /// Bytes that do.
        found: u64,
    },
    /// The hash is another one: something was changed.
    Damaged,
    /// Made by another version: the version of its format.
    Version(u32),
    /// Made for another machine.
    Target(Option<Target>),
    /// The processor lacks these extensions.
    Processor(Vec<String>),
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FormatError::Foreign => f.write_str("it holds no model"),
            FormatError::Length { wanted, found } => write!(
                f,
                "it was cut off or extended: {found} bytes follow where its model has {wanted}; copy or build it again"
            ),
            FormatError::Damaged => f.write_str("its model is damaged: the checksum is wrong; copy or build it again"),
            FormatError::Version(found) => write!(
                f,
                "its model has format {found}, but this program reads format {VERSION}; build it again with the same hyd"
            ),
            FormatError::Target(Some(target)) => {
                let here = Target::host().map_or_else(|| "another machine".to_string(), |host| host.to_string());
                write!(f, "its code is for {target}, but this machine is {here}; build it again here")
            }
            FormatError::Target(None) => f.write_str("its code is for a machine that this program does not know"),
            FormatError::Processor(missing) => write!(
                f,
                "its code uses {}, which this processor lacks; `--backend vm` interprets it",
                missing.join(", ")
            ),
        }
    }
}

impl std::error::Error for FormatError {}

/// Bytes of a model.
pub fn write(model: &Model) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend_from_slice(&MAGIC);
    VERSION.put(&mut out);
    // Without code it runs everywhere.
    model.code.as_ref().and(Target::host()).map_or(0, Target::number).put(&mut out);
    model.code.as_ref().map_or(0, |code| code.features()).put(&mut out);
    out.resize(HEADER, 0);
    put_model(model, &mut out);
    seal(&mut out);
    out
}

/// A number that is another one, all but surely, when the model is; none for bytes that are no payload.
pub fn fingerprint(bytes: &[u8]) -> Option<u64> {
    let place = bytes.get(..HEADER).filter(|header| header[..8] == MAGIC)?;
    u64::get(&mut Input(&place[HEADER - 8..])).ok()
}

/// Puts length and checksum of a payload right; nothing is done where there is not even a header.
pub fn seal(bytes: &mut [u8]) {
    let Some(length) = bytes.len().checked_sub(HEADER) else { return };
    bytes[HEADER - 16..HEADER - 8].copy_from_slice(&(length as u64).to_le_bytes());
    let hash = hash(bytes);
    bytes[HEADER - 8..HEADER].copy_from_slice(&hash.to_le_bytes());
}

/// The model in bytes.  `natively`: its code is to run, so it must suit this processor.
///
/// # Errors
/// Why it is refused.
pub fn read(bytes: &[u8], natively: bool) -> Result<Model, FormatError> {
    let (header, body) = bytes.split_at_checked(HEADER).ok_or(FormatError::Foreign)?;
    if header[..8] != MAGIC {
        return Err(FormatError::Foreign);
    }
    let mut input = Input(&header[8..]);
    let damaged = |_| FormatError::Damaged;
    let mut number = || u32::get(&mut input).map_err(damaged);
    let (version, target, features) = (number()?, number()?, number()?);
    let (length, wanted) = (u64::get(&mut input).map_err(damaged)?, u64::get(&mut input).map_err(damaged)?);
    if version != VERSION {
        return Err(FormatError::Version(version));
    }
    if length != body.len() as u64 {
        return Err(FormatError::Length { wanted: length, found: body.len() as u64 });
    }
    if hash(bytes) != wanted {
        return Err(FormatError::Damaged);
    }
    if target != 0 && Target::from_number(target) != Target::host() {
        return Err(FormatError::Target(Target::from_number(target)));
    }
    let missing = target::missing(features);
    if natively && !missing.is_empty() {
        return Err(FormatError::Processor(missing));
    }
    let mut input = Input(body);
    let model = get_model(&mut input, features).map_err(damaged)?;
    if input.0.is_empty() { Ok(model) } else { Err(FormatError::Damaged) }
}

/// Over everything but the place of the hash itself.
fn hash(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |word: u64| hash = (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(23);
    for part in [&bytes[..HEADER - 8], &bytes[HEADER..]] {
        let words = part.chunks_exact(8);
        let rest = words.remainder();
        words.for_each(|word| add(word.iter().rev().fold(0, |sum, &byte| (sum << 8) | u64::from(byte))));
        rest.iter().for_each(|&byte| add(u64::from(byte)));
    }
    hash
}

fn put_model(model: &Model, out: &mut Vec<u8>) {
    model.identity.put(out);
    model.experiment.put(out);
    put_code(model.code.as_deref(), out);
    model.program.put(out);
    model.routines.put(out);
    model.area.put(out);
    model.structure.put(out);
    model.tables.put(out);
    model.row.put(out);
    model.nominals.put(out);
    model.tested.put(out);
    model.initial_nominals.put(out);
    model.parameters.put(out);
    model.checks.put(out);
    model.initial.put(out);
    model.names.0.put(out);
    model.rows.put(out);
    model.candidates.put(out);
    model.delays.put(out);
    model.tangents.is_some().put(out);
    if let Some(tangents) = &model.tangents {
        put_tangents(tangents, out);
    }
}

fn get_model(input: &mut Input<'_>, features: u32) -> Result<Model, crate::Damage> {
    Ok(Model {
        identity: Stored::get(input)?,
        experiment: Stored::get(input)?,
        code: get_code(input, features)?,
        program: Arc::new(Stored::get(input)?),
        routines: Arc::new(Stored::get(input)?),
        area: Stored::get(input)?,
        structure: Stored::get(input)?,
        tables: Arc::new(Stored::get(input)?),
        row: Stored::get(input)?,
        nominals: Stored::get(input)?,
        tested: Stored::get(input)?,
        initial_nominals: Stored::get(input)?,
        parameters: Stored::get(input)?,
        checks: Stored::get(input)?,
        initial: Stored::get(input)?,
        names: Names(Stored::get(input)?),
        rows: Stored::get(input)?,
        candidates: Stored::get(input)?,
        delays: Stored::get(input)?,
        tangents: if bool::get(input)? { Some(Arc::new(get_tangents(input, features)?)) } else { None },
    })
}

fn put_tangents(tangents: &TangentModel, out: &mut Vec<u8>) {
    put_code(tangents.code.as_deref(), out);
    tangents.program.put(out);
    tangents.spaces.put(out);
    tangents.stages.put(out);
    tangents.starts.put(out);
    tangents.sweep.is_some().put(out);
    if let Some(sweep) = &tangents.sweep {
        put_code(sweep.code.as_deref(), out);
        sweep.program.put(out);
        (sweep.routine, sweep.state_entries).put(out);
        sweep.arguments.put(out);
        sweep.branches.put(out);
        sweep.entries.put(out);
        sweep.still.put(out);
    }
}

fn get_tangents(input: &mut Input<'_>, features: u32) -> Result<TangentModel, crate::Damage> {
    Ok(TangentModel {
        code: get_code(input, features)?,
        program: Arc::new(Stored::get(input)?),
        spaces: Stored::get(input)?,
        stages: Stored::get(input)?,
        starts: Stored::get(input)?,
        sweep: if bool::get(input)? { Some(get_sweep(input, features)?) } else { None },
    })
}

fn get_sweep(input: &mut Input<'_>, features: u32) -> Result<SweepModel, crate::Damage> {
    Ok(SweepModel {
        code: get_code(input, features)?,
        program: Arc::new(Stored::get(input)?),
        routine: Stored::get(input)?,
        state_entries: Stored::get(input)?,
        arguments: Stored::get(input)?,
        branches: Stored::get(input)?,
        entries: Stored::get(input)?,
        still: Stored::get(input)?,
    })
}

fn put_code(code: Option<&Code>, out: &mut Vec<u8>) {
    code.is_some().put(out);
    let Some(code) = code else { return };
    code.bytes().len().put(out);
    out.extend_from_slice(code.bytes());
    code.all_entries().put(out);
    code.bodies().to_vec().put(out);
    code.tables().to_vec().put(out);
    code.extents().put(out);
}

fn get_code(input: &mut Input<'_>, features: u32) -> Result<Option<Arc<Code>>, crate::Damage> {
    if !bool::get(input)? {
        return Ok(None);
    }
    let length = usize::get(input)?;
    let bytes = input.take(length)?.to_vec();
    let starts = (Stored::get(input)?, Stored::get(input)?);
    let (tables, extents): (Vec<u32>, Extents) = (Stored::get(input)?, Stored::get(input)?);
    // SAFETY: the hash has shown that these are the bytes that the compiler wrote for this target.
    #[allow(unsafe_code)]
    let code = unsafe { Code::new(bytes, starts, tables, extents, features) };
    Ok(Some(Arc::new(code)))
}
