//! The messages of a file, in the order in which they were recorded.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::ops::Range;

use super::chunk::{CHUNK_BYTES_MAX, unpack};
use super::fields::Fields;
use crate::log::error::{Damage, DamageKind, LogError, Place};
use crate::log::message::{Topic, is_name};
use crate::log::messages::Messages;

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// Operation codes of records.
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// Bytes of a record's operation code and length.
const RECORD_HEAD: usize = 9;

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
    /// Where in `content` the message is that was given out last.
    message: Range<usize>,
    /// Names of types by the numbers of schemas.
    schemas: BTreeMap<u16, String>,
    /// Numbers in `topics` by those of channels.
    channels: BTreeMap<u16, usize>,
    topics: Vec<Topic>,
    damage: Option<Damage>,
    /// True behind the data: what follows is for readers that jump.
    is_in_summary: bool,
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
            message: 0..0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            topics: Vec::new(),
            damage: None,
            is_in_summary: false,
            is_over: false,
            bytes_max: CHUNK_BYTES_MAX,
        })
    }

    /// This reader, which reads records and chunks of up to so many bytes instead of [`CHUNK_BYTES_MAX`].
    #[must_use]
    pub fn with_chunk_bytes_max(self, bytes_max: usize) -> Self {
        Self { bytes_max, ..self }
    }

    /// Reads the next record of the file, and puts what is in it into `content`.
    fn read_record(&mut self) -> Result<Result<(), DamageKind>, LogError> {
        self.record_at = self.position;
        self.content.clear();
        self.next = 0;
        let mut head = [0; RECORD_HEAD];
        if !self.fill(&mut head)? {
            return Ok(self.cut_off());
        }
        let (code, len) = parse_head(&head);
        if code == FOOTER {
            self.is_over = true;
            return self.read_end(len);
        }
        self.is_in_summary |= code == DATA_END;
        // A summary repeats what was read.
        let is_used = !self.is_in_summary && matches!(code, SCHEMA | CHANNEL | MESSAGE | CHUNK);
        if is_used && len > self.bytes_max as u64 {
            return Ok(Err(DamageKind::TooLong { bytes: len, max: self.bytes_max }));
        }
        if !is_used {
            // Attachments, indexes, metadata: they may be of any length, and are passed over.
            let skipped = std::io::copy(&mut self.file.by_ref().take(len), &mut std::io::sink())?;
            self.position += skipped;
            return Ok(if skipped == len { Ok(()) } else { self.cut_off() });
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

    /// The file ends too early. Where that is in the summary, all messages are there.
    fn cut_off(&mut self) -> Result<(), DamageKind> {
        self.is_over = true;
        if self.is_in_summary { Ok(()) } else { Err(DamageKind::CutOff) }
    }

    /// Passes over the footer and what ends a file, to see that nothing follows.
    fn read_end(&mut self, footer_len: u64) -> Result<Result<(), DamageKind>, LogError> {
        let end = footer_len.saturating_add(MAGIC.len() as u64);
        self.position += std::io::copy(&mut self.file.by_ref().take(end), &mut std::io::sink())?;
        self.record_at = self.position;
        let more = std::io::copy(&mut self.file.by_ref().take(1), &mut std::io::sink())?;
        Ok(if more == 0 { Ok(()) } else { Err(DamageKind::Appended) })
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

    /// The next record of `content`: of a message, its topic and its time.
    fn next_of_content(&mut self) -> Result<Option<(usize, u64)>, DamageKind> {
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
                self.message = end - len..end;
                return Ok(self.channels.get(&channel).map(|&topic| (topic, log_time_ns)));
            }
            _ => {}
        }
        Ok(None)
    }
}

impl<R: Read> Messages for McapReader<R> {
    fn advance(&mut self) -> Result<Option<(usize, u64)>, LogError> {
        while !self.is_over {
            let found = match self.next < self.content.len() {
                true => self.next_of_content(),
                false => self.read_record()?.map(|()| None),
            };
            match found {
                Ok(Some(message)) => return Ok(Some(message)),
                Ok(None) => {}
                Err(why) => {
                    self.damage = Some(Damage { file: None, at: Place::Byte(self.record_at), why });
                    self.is_over = true;
                }
            }
        }
        self.message = 0..0;
        Ok(None)
    }

    fn data(&self) -> &[u8] {
        &self.content[self.message.clone()]
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn position(&self) -> u64 {
        self.position
    }

    fn damages(&self) -> &[Damage] {
        self.damage.as_slice()
    }
}

/// The operation code and the length of a record.
fn parse_head(head: &[u8; RECORD_HEAD]) -> (u8, u64) {
    let [code, len @ ..] = *head;
    (code, u64::from_le_bytes(len))
}
