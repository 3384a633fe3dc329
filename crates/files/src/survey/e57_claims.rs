//! What the XML of an E57 file asks of its reader, checked before it is parsed.
//!
//! The parser takes time by the square or the cube of how deep and how wide elements are, whatever is in them. Those of
//! files that scanners write are few.

use std::io::{Read, Seek, SeekFrom};

use super::error::SurveyError;

/// How a file begins.
const SIGNATURE: &[u8] = b"ASTM-E57";
/// Bytes of the header.
const HEADER_BYTES: usize = 48;
/// Where it says where the XML lies, how long it is, and how large pages are.
const XML_OFFSET_AT: usize = 24;
const XML_LENGTH_AT: usize = 32;
const PAGE_BYTES_AT: usize = 40;
/// The end of each page is its checksum.
const CHECKSUM_BYTES: u64 = 4;
const PAGE_BYTES_MAX: u64 = 1 << 20;
/// Most bytes of XML: some thousand scans.
const XML_BYTES_MAX: u64 = 16 << 20;
/// How deep its elements may lie, and how many attributes one may have.
const DEPTH_MAX: usize = 64;
const ATTRIBUTES_MAX: usize = 256;

/// Checks the XML of a file of `length` bytes.
///
/// # Errors
/// Names the limit that it exceeds. What is no E57 is left to its reader.
pub(super) fn check(file: &mut (impl Read + Seek), length: u64) -> Result<(), SurveyError> {
    let Some(xml) = xml_of(file, length)? else { return Ok(()) };
    check_elements(&xml)
}

/// The XML, without the checksums of its pages; none where the header names none that could be read.
fn xml_of(file: &mut (impl Read + Seek), length: u64) -> Result<Option<Vec<u8>>, SurveyError> {
    let mut header = [0; HEADER_BYTES];
    if length < HEADER_BYTES as u64 {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(0))?;
    file.read_exact(&mut header)?;
    let number = |at: usize| header[at..].first_chunk().map_or(0, |&bytes| u64::from_le_bytes(bytes));
    let [offset, bytes, page] = [XML_OFFSET_AT, XML_LENGTH_AT, PAGE_BYTES_AT].map(number);
    let has_pages = (CHECKSUM_BYTES + 1..=PAGE_BYTES_MAX).contains(&page);
    if !header.starts_with(SIGNATURE) || offset > length || !has_pages {
        return Ok(None);
    }
    if bytes > XML_BYTES_MAX {
        return Err(too_large(format!("its XML has {bytes} bytes, the limit is {XML_BYTES_MAX}")));
    }
    file.seek(SeekFrom::Start(offset))?;
    let (mut xml, mut place) = (Vec::new(), offset);
    while (xml.len() as u64) < bytes {
        let of_page = page - CHECKSUM_BYTES - (place % page).min(page - CHECKSUM_BYTES);
        let wanted = of_page.min(bytes - xml.len() as u64);
        let read = (&mut *file).take(wanted).read_to_end(&mut xml)? as u64;
        file.seek(SeekFrom::Current(CHECKSUM_BYTES.cast_signed()))?;
        place += of_page + CHECKSUM_BYTES;
        if read < wanted || place > length {
            break;
        }
    }
    Ok(Some(xml))
}

/// Walks from tag to tag. Comments and quoted text may have brackets too, which only make the bounds narrower.
fn check_elements(xml: &[u8]) -> Result<(), SurveyError> {
    let mut depth = 0usize;
    for tag in xml.split(|&byte| byte == b'<').skip(1) {
        let tag = tag.split(|&byte| byte == b'>').next().unwrap_or_default();
        let attributes = tag.iter().filter(|&&byte| byte == b'=').count();
        if attributes > ATTRIBUTES_MAX {
            return Err(too_large(format!(
                "an element of its XML has {attributes} attributes, the limit is {ATTRIBUTES_MAX}"
            )));
        }
        match (tag.first(), tag.last()) {
            (Some(b'/'), _) => depth = depth.saturating_sub(1),
            (Some(b'?' | b'!'), _) | (_, Some(b'/')) => {}
            _ => depth += 1,
        }
        if depth > DEPTH_MAX {
            return Err(too_large(format!("elements of its XML lie more than {DEPTH_MAX} deep")));
        }
    }
    Ok(())
}

fn too_large(problem: String) -> SurveyError {
    SurveyError::Content(problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn file(xml: &str) -> Vec<u8> {
        let mut content = vec![0; HEADER_BYTES];
        content[..SIGNATURE.len()].copy_from_slice(SIGNATURE);
        let mut put = |at: usize, number: u64| content[at..at + 8].copy_from_slice(&number.to_le_bytes());
        put(XML_OFFSET_AT, HEADER_BYTES as u64);
        put(XML_LENGTH_AT, xml.len() as u64);
        put(PAGE_BYTES_AT, 1024);
        content.extend(xml.as_bytes());
        content.chunks(1020).flat_map(|page| [page, b"<<<<"].concat()).collect()
    }

    fn checked(xml: &str) -> Result<(), String> {
        let file = file(xml);
        check(&mut Cursor::new(&file), file.len() as u64).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_deep_or_wide_is_refused_and_what_is_long_is_not() {
        let nested = |levels: usize| "<a xmlns:b=\"c\">".repeat(levels) + &"</a>".repeat(levels);
        assert_eq!(checked(&nested(64)), Ok(()));
        assert!(checked(&nested(65)).unwrap_err().contains("more than 64 deep"));
        assert_eq!(
            checked(&format!(
                "<?xml version=\"1.0\"?><e57Root>{}</e57Root>",
                "<a b=\"1\"/><c>2</c>".repeat(2000)
            )),
            Ok(())
        );
        let wide = format!("<a {}/>", "b=\"\" ".repeat(257));
        assert!(checked(&wide).unwrap_err().contains("257 attributes, the limit is 256"));
    }

    #[test]
    fn what_is_no_e57_is_left_to_its_reader() {
        for bytes in [&b""[..], b"ASTM-E57", &[0; 48], &[0xff; 4096]] {
            assert!(check(&mut Cursor::new(bytes), bytes.len() as u64).is_ok());
        }
        let mut huge = file("<a/>");
        huge[XML_LENGTH_AT..XML_LENGTH_AT + 8].fill(0xff);
        let refused = check(&mut Cursor::new(&huge), huge.len() as u64).unwrap_err().to_string();
        assert!(refused.contains("the limit is 16777216"), "{refused}");
    }
}
