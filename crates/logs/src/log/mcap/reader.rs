//! The messages of a file, in the order in which they were recorded.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};

use super::chunk::{CHUNK_BYTES_MAX, unpack};
use super::fields::Fields;
use crate::log::error::{Damage, DamageKind, LogError};
use crate::log::message::{LogMessage, Topic};

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// Operation codes of records.
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// Bytes of a record's operation code and length.
const RECORD_HEAD: usize = 9;
/// Bytes of a topic's name, or of its type's, at most.
const NAME_BYTES_MAX: usize = 1024;

/// Reads the messages of an MCAP file.
#[derive(Debug)]
pub struct McapReader<R> {
    file: R,
    /// Bytes of the file that were read.
    position: u64,
    /// Where the record begins whose messages are given out.
    record_at: u64,
    /// The record of the file that was read last; its allocation is used again.
    record: Vec<u8>,
    /// Records that are given out one by one: those of a chunk, or a record of the file.
    content: Vec<u8>,
    /// Where the next of them begins.
    next: usize,
    /// Names of types by the numbers of schemas.
    schemas: BTreeMap<u16, String>,
    /// Numbers in `topics` by those of channels.
    channels: BTreeMap<u16, usize>,
    topics: Vec<Topic>,
    damage: Option<Damage>,
    is_over: bool,
    bytes_max: usize,
}

impl<R: Read> McapReader<R> {
    /// A reader of a file, at its begin.
    ///
    /// # Errors
    /// When it cannot be read, or is no MCAP file.
    pub fn new(mut file: R) -> Result<Self, LogError> {
        let mut magic = Vec::new();
        file.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic)?;
        if magic != MAGIC {
            return Err(LogError::NoMcap(magic));
        }
        Ok(Self {
            file,
            position: MAGIC.len() as u64,
            record_at: MAGIC.len() as u64,
            record: Vec::new(),
            content: Vec::new(),
            next: 0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            topics: Vec::new(),
            damage: None,
            is_over: false,
            bytes_max: CHUNK_BYTES_MAX,
        })
    }

    /// This reader, which reads records and chunks of up to so many bytes instead of [`CHUNK_BYTES_MAX`].
    #[must_use]
    pub fn with_chunk_bytes_max(self, bytes_max: usize) -> Self {
        Self { bytes_max, ..self }
    }

    /// The topics that were met so far, in the order in which they were met; their numbers stay.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Bytes of the file that were read.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Where and why the log was not read to its end, once [`McapReader::next_message`] gave none.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// The next message; none at the end, and where the log is [damaged](McapReader::damage).
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<LogMessage<'_>>, LogError> {
        loop {
            if self.is_over {
                return Ok(None);
            }
            let found = match self.next < self.content.len() {
                true => self.next_of_content(),
                false => match self.read_record()? {
                    Ok(()) => continue,
                    Err(why) => Err(why),
                },
            };
            match found {
                Ok(Some((topic, log_time_ns, begin, end))) => {
                    return Ok(Some(LogMessage { topic, log_time_ns, data: &self.content[begin..end] }));
                }
                Ok(None) => {}
                Err(why) => {
                    self.damage = Some(Damage { at: self.record_at, why });
                    self.is_over = true;
                }
            }
        }
    }

    /// Reads the next record of the file, and puts what is in it into `content`.
    fn read_record(&mut self) -> Result<Result<(), DamageKind>, LogError> {
        self.record_at = self.position;
        self.content.clear();
        self.next = 0;
        let mut head = [0; RECORD_HEAD];
        if !self.fill(&mut head)? {
            return Ok(Err(DamageKind::CutOff));
        }
        let (code, len) = parse_head(&head);
        if code == DATA_END {
            self.is_over = true;
            return Ok(Ok(()));
        }
        let is_used = matches!(code, SCHEMA | CHANNEL | MESSAGE | CHUNK);
        if is_used && len > self.bytes_max as u64 {
            return Ok(Err(DamageKind::TooLong { bytes: len, max: self.bytes_max }));
        }
        if !is_used {
            // Attachments, indexes, metadata: they may be of any length, and are passed over.
            let skipped = std::io::copy(&mut self.file.by_ref().take(len), &mut std::io::sink())?;
            self.position += skipped;
            return Ok(if skipped == len { Ok(()) } else { Err(DamageKind::CutOff) });
        }
        // What is read grows with what is there, and not by what is claimed.
        let target = if code == CHUNK { &mut self.record } else { &mut self.content };
        target.clear();
        if code != CHUNK {
            target.extend(head);
        }
        let read = self.file.by_ref().take(len).read_to_end(target)? as u64;
        self.position += read;
        if read < len {
            self.content.clear();
            return Ok(Err(DamageKind::CutOff));
        }
        Ok(match code {
            CHUNK => {
                unpack(&self.record, &mut self.content, self.bytes_max).inspect_err(|_| self.content.clear())
            }
            _ => Ok(()),
        })
    }

    /// True where the file had bytes for all of `buffer`.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<bool, LogError> {
        match self.file.read_exact(buffer) {
            Ok(()) => {
                self.position += buffer.len() as u64;
                Ok(true)
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// The next record of `content`: of a message, its topic, its time, and where its bytes begin and end.
    fn next_of_content(&mut self) -> Result<Option<(usize, u64, usize, usize)>, DamageKind> {
        let rest = &self.content[self.next..];
        let head = rest.first_chunk::<RECORD_HEAD>().ok_or(DamageKind::Format("chunk"))?;
        let (code, len) = parse_head(head);
        let body = usize::try_from(len).ok().and_then(|len| rest[RECORD_HEAD..].get(..len));
        let body = body.ok_or(DamageKind::Format("record"))?;
        self.next += RECORD_HEAD + body.len();
        match code {
            SCHEMA => {
                let mut fields = Fields::new("schema", body);
                let (id, name) = (fields.u16()?, fields.text()?);
                if is_name(name) {
                    self.schemas.entry(id).or_insert_with(|| name.to_owned());
                }
            }
            CHANNEL => {
                let mut fields = Fields::new("channel", body);
                let (id, schema) = (fields.u16()?, fields.u16()?);
                let (name, encoding) = (fields.text()?, fields.text()?);
                let is_new = !self.channels.contains_key(&id);
                if is_new && is_name(name) && is_name(encoding) {
                    let type_name = self.schemas.get(&schema).cloned().unwrap_or_default();
                    self.channels.insert(id, self.topics.len());
                    let (name, encoding) = (name.to_owned(), encoding.to_owned());
                    self.topics.push(Topic { name, type_name, encoding });
                }
            }
            MESSAGE => {
                let mut fields = Fields::new("message", body);
                let (channel, _, log_time_ns, _) =
                    (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
                let (end, len) = (self.next, fields.rest().len());
                let topic = self.channels.get(&channel);
                return Ok(topic.map(|&topic| (topic, log_time_ns, end - len, end)));
            }
            _ => {}
        }
        Ok(None)
    }
}

/// True of a name that can be told: others, and what they name, are left out.
fn is_name(name: &str) -> bool {
    name.len() <= NAME_BYTES_MAX && !name.contains(char::is_control)
}

/// The operation code and the length of a record.
fn parse_head(head: &[u8; RECORD_HEAD]) -> (u8, u64) {
    let [code, len @ ..] = *head;
    (code, u64::from_le_bytes(len))
}
