//! An archive: what stands in it is checked before anything is written, then its files go to a folder of their own.
//!
//! No entry may lead out of the folder, be a link, or stand there twice; entries and bytes are counted as they come, whatever the archive
//! says of itself.  Source: Functional Mock-up Interface 2.0.4, section 2.3; 3.0.2, section 2.5.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use zip::ZipArchive;
use zip::read::ZipFile;

use crate::description::{Description, Interface, Version};
use crate::fault::Fault;
use crate::folder::Folder;
use crate::terminals;

/// Entries of an archive.
const MOST_ENTRIES: usize = 50_000;
/// Bytes of all files together.
const MOST_BYTES: u64 = 8 << 30;
/// Bytes of a description.
const LONGEST_DESCRIPTION: u64 = 512 << 20;
/// Folders that a path leads through.
const DEEPEST: usize = 64;
/// Bytes that are copied at a time.
const CHUNK: usize = 1 << 16;

/// What the end of an archive begins with, and how many bytes it has at most, with its comment.
const END: [u8; 4] = *b"PK\x05\x06";
const LONGEST_END: u64 = 22 + (1 << 16);

const DESCRIPTION: &str = "modelDescription.xml";
const TERMINALS: &str = "terminalsAndIcons/terminalsAndIcons.xml";

/// A unit whose files lie in a folder of their own, which is gone with it.
#[derive(Clone, Debug)]
pub struct Unit {
    /// What it says of itself.
    pub description: Arc<Description>,
    /// What messages call it: the name of its file.
    pub file: String,
    /// What it says that no use is made of, in sentences.
    pub notes: Vec<String>,
    pub(crate) folder: Arc<Folder>,
}

/// How many entries the end of an archive says that there are (APPNOTE 6.3.10, section 4.3.16); none where that has no end of the usual kind, or more entries
/// than it can count.
fn entries_listed(source: &mut (impl Read + Seek)) -> std::io::Result<Option<usize>> {
    let length = source.seek(SeekFrom::End(0))?;
    source.seek(SeekFrom::Start(length.saturating_sub(LONGEST_END)))?;
    let mut end = Vec::new();
    source.read_to_end(&mut end)?;
    source.rewind()?;
    let at = end.windows(END.len()).rposition(|own| own == END);
    let count = at.and_then(|at| end.get(at + 10..at + 12)).map(|own| u16::from_le_bytes([own[0], own[1]]));
    Ok(count.filter(|&count| count < u16::MAX).map(usize::from))
}

impl Unit {
    /// Reads an archive.
    ///
    /// # Errors
    /// A sentence: not an archive, damaged, dangerous, not a unit of a version that is read, no library for this machine.
    pub fn open(path: &Path) -> Result<Self, Fault> {
        let file = path.display().to_string();
        let of = |sentence: String| Fault::of(&file, sentence);
        let source = File::open(path).map_err(|error| of(format!("the file cannot be read: {error}")))?;
        let mut source = BufReader::new(source);
        let listed = entries_listed(&mut source).ok().flatten();
        let archive = ZipArchive::new(source);
        let mut archive =
            archive.map_err(|error| of(format!("it is not a unit: not an archive that can be read ({error})")))?;
        // Of two entries of one name the archive's reader shows the second alone.
        if listed.is_some_and(|listed| listed != archive.len()) {
            return Err(of("an entry stands in the archive twice".to_string()));
        }
        Self::unpack(&mut archive, &file).map_err(|fault| of(fault.to_string()))
    }

    fn unpack<R: Read + Seek>(archive: &mut ZipArchive<R>, file: &str) -> Result<Self, Fault> {
        let entries = check(archive)?;
        let bytes = whole(archive, DESCRIPTION)?;
        let bytes =
            bytes.ok_or_else(|| Fault::new(format!("it is not a unit: there is no `{DESCRIPTION}` in the archive")))?;
        let mut description = Description::read(&bytes)?;
        let mut notes: Vec<String> = without_library(&mut description, &entries)?.into_iter().collect();
        if let Some(bytes) = whole(archive, TERMINALS)? {
            match terminals::read(&bytes) {
                Ok(terminals) => description.terminals = terminals,
                Err(fault) => notes.push(format!("connectors of the unit are not known: {fault}")),
            }
        }
        let folder =
            Folder::new().map_err(|error| Fault::new(format!("no folder can be made for its files: {error}")))?;
        extract(archive, folder.path())?;
        Ok(Self { description: Arc::new(description), file: file.to_string(), notes, folder: Arc::new(folder) })
    }

    /// The library of an interface.
    pub(crate) fn library(&self, interface: &Interface) -> PathBuf {
        self.folder.path().join(library(self.description.version, &interface.identifier))
    }

    /// Where the unit finds its resources: an address in 2.0, a path in 3.0.
    pub(crate) fn resources(&self) -> String {
        let path = self.folder.path().join("resources");
        match self.description.version {
            Version::Two => format!("file://{}", address(&path)),
            // With the separator, because units put names behind it.
            Version::Three => format!("{}{}", path.display(), std::path::MAIN_SEPARATOR),
        }
    }
}

/// A path as the part of an address behind the host (RFC 3986, section 2).
fn address(path: &Path) -> String {
    let mut text = String::new();
    for &byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => text.push(char::from(byte)),
            _ => text.push_str(&format!("%{byte:02X}")),
        }
    }
    text
}

/// The folder for libraries of this machine.
pub(crate) fn platform(version: Version) -> String {
    let (system, processor) = (std::env::consts::OS, std::env::consts::ARCH);
    match version {
        Version::Three => {
            let system = if system == "macos" { "darwin" } else { system };
            format!("{processor}-{system}")
        }
        Version::Two => match (system, processor) {
            ("linux", "x86_64") => "linux64".to_string(),
            ("windows", "x86_64") => "win64".to_string(),
            ("macos", _) => "darwin64".to_string(),
            _ => format!("{processor}-{system}"),
        },
    }
}

fn library(version: Version, identifier: &str) -> String {
    let ending = std::env::consts::DLL_EXTENSION;
    format!("binaries/{}/{identifier}.{ending}", platform(version))
}

/// Takes back what the unit offers without a library for this machine; a sentence on that.
///
/// # Errors
/// Nothing is left.
fn without_library(description: &mut Description, entries: &BTreeSet<String>) -> Result<Option<String>, Fault> {
    let version = description.version;
    let is_there = |interface: &Interface| entries.contains(&library(version, &interface.identifier));
    let both = [("model exchange", &description.exchange), ("co-simulation", &description.stepping)];
    let offered = both.into_iter().filter_map(|(name, interface)| Some((name, interface.as_ref()?)));
    let missing: Vec<(&str, String)> = offered
        .filter(|(_, interface)| !is_there(interface))
        .map(|(name, interface)| (name, library(version, &interface.identifier)))
        .collect();
    description.exchange = description.exchange.take().filter(is_there);
    description.stepping = description.stepping.take().filter(is_there);
    let Some((name, file)) = missing.first() else { return Ok(None) };
    if description.exchange.is_some() || description.stepping.is_some() {
        return Ok(Some(format!("the unit offers {name}, but its library `{file}` is not there")));
    }
    let binaries = entries.iter().filter_map(|entry| entry.strip_prefix("binaries/")?.split_once('/'));
    let folders: BTreeSet<&str> = binaries.filter(|(_, file)| !file.is_empty()).map(|(folder, _)| folder).collect();
    let own = platform(version);
    let has = match folders.len() {
        0 => "it has no libraries at all, perhaps only source text, and hyd compiles none".to_string(),
        _ if folders.contains(own.as_str()) => format!("`{file}` is not there"),
        _ => format!("it has libraries for {}", folders.into_iter().collect::<Vec<_>>().join(", ")),
    };
    Err(Fault::new(format!("the unit has no library for this machine ({own}): {has}")))
}

/// Refuses what an archive of a unit never has; gives the names of its files.
fn check<R: Read + Seek>(archive: &mut ZipArchive<R>) -> Result<BTreeSet<String>, Fault> {
    if archive.len() > MOST_ENTRIES {
        return Err(Fault::new(format!("the archive has {} entries, more than {MOST_ENTRIES}", archive.len())));
    }
    let mut names = BTreeSet::new();
    for k in 0..archive.len() {
        let entry = archive.by_index_raw(k).map_err(|error| damaged(&format!("entry {}", k + 1), &error))?;
        let path = inside(&entry)?;
        if entry.encrypted() {
            return Err(Fault::new(format!("`{}` is encrypted", shown(&entry))));
        }
        if entry.is_file() {
            let name = path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
            if !names.insert(name) {
                return Err(Fault::new(format!("`{}` stands twice in the archive", shown(&entry))));
            }
        }
    }
    Ok(names)
}

/// Where an entry goes, below the folder of the unit.
fn inside<R: Read>(entry: &ZipFile<'_, R>) -> Result<PathBuf, Fault> {
    let wrong = |what: &str| Fault::new(format!("the archive is refused: `{}` {what}", shown(entry)));
    let name = entry.name().map_err(|_| wrong("has a name that is not a text"))?;
    // Windows takes both for separators, and so do archives made there.
    let name = name.replace('\\', "/");
    if entry.is_symlink() {
        return Err(wrong("is a link"));
    }
    if name.contains('\0') || name.contains(':') {
        return Err(wrong("has a name that no file of a unit has"));
    }
    let path = Path::new(&name);
    let plain = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !plain || name.starts_with('/') {
        return Err(wrong("leads out of the folder of the unit"));
    }
    let path: PathBuf = path.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    if path.components().count() > DEEPEST {
        return Err(wrong("lies too deep"));
    }
    if path.as_os_str().is_empty() && entry.is_file() {
        return Err(wrong("has no name"));
    }
    Ok(path)
}

fn shown<R: Read>(entry: &ZipFile<'_, R>) -> String {
    let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
    crate::xml::shortened(&name.escape_debug().to_string())
}

fn damaged(what: &str, error: &dyn std::fmt::Display) -> Fault {
    Fault::new(format!("the archive is damaged at {what}: {error}"))
}

/// The bytes of an entry; none where it is not there.
fn whole<R: Read + Seek>(archive: &mut ZipArchive<R>, name: &str) -> Result<Option<Vec<u8>>, Fault> {
    let Some(k) = archive.index_for_name(name) else { return Ok(None) };
    let entry = archive.by_index(k).map_err(|error| damaged(&format!("`{name}`"), &error))?;
    let mut bytes = Vec::new();
    let read = entry.take(LONGEST_DESCRIPTION + 1).read_to_end(&mut bytes);
    read.map_err(|error| damaged(&format!("`{name}`"), &error))?;
    if bytes.len() as u64 > LONGEST_DESCRIPTION {
        return Err(Fault::new(format!("`{name}` has more than {} MB", LONGEST_DESCRIPTION >> 20)));
    }
    Ok(Some(bytes))
}

/// Writes all files below a folder.
fn extract<R: Read + Seek>(archive: &mut ZipArchive<R>, folder: &Path) -> Result<(), Fault> {
    let mut left = MOST_BYTES;
    let mut buffer = vec![0; CHUNK];
    for k in 0..archive.len() {
        let mut entry = archive.by_index(k).map_err(|error| damaged(&format!("entry {}", k + 1), &error))?;
        let path = folder.join(inside(&entry)?);
        let name = shown(&entry);
        let written = |error: std::io::Error| Fault::new(format!("`{name}` cannot be unpacked: {error}"));
        if !entry.is_file() {
            std::fs::create_dir_all(&path).map_err(written)?;
            continue;
        }
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(written)?;
        }
        // A file that is there already is one that the archive has twice in other words.
        let mut target = OpenOptions::new().write(true).create_new(true).open(&path).map_err(written)?;
        loop {
            let count = entry.read(&mut buffer).map_err(|error| damaged(&format!("`{name}`"), &error))?;
            if count == 0 {
                break;
            }
            let rest = left.checked_sub(count as u64);
            left = rest.ok_or_else(|| Fault::new(format!("its files have more than {} GB", MOST_BYTES >> 30)))?;
            target.write_all(&buffer[..count]).map_err(written)?;
        }
    }
    Ok(())
}
