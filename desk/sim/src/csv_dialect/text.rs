//! Decoding of bytes, and splitting into lines and cells.

use std::borrow::Cow;

use anyhow::bail;

/// Tried in this order; a blank stands for any run of blanks.
pub const SEPARATORS: [char; 4] = [',', ';', '\t', ' '];

/// A separator in words.
pub fn name(separator: char) -> &'static str {
    match separator {
        ',' => "comma",
        ';' => "semicolon",
        '\t' => "tab",
        _ => "blank",
    }
}

/// Text of any encoding that spreadsheets and loggers use: UTF-8, UTF-16 with its mark, else Latin-1.
///
/// # Errors
/// If it is compressed, or contains zero bytes, so that it is no text.
pub fn decode(bytes: &[u8]) -> anyhow::Result<Cow<'_, str>> {
    let wide = |swap: fn([u8; 2]) -> u16| {
        let (pairs, _) = bytes.as_chunks::<2>();
        let units: Vec<u16> = pairs.iter().map(|pair| swap(*pair)).skip(1).collect();
        Cow::Owned(String::from_utf16_lossy(&units))
    };
    let text = match bytes {
        [0x1f, 0x8b, ..] => bail!("compressed by gzip: unpack it first"),
        [b'P', b'K', 3, 4, ..] => bail!("a spreadsheet or an archive: save it as CSV"),
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] | rest => match str::from_utf8(rest) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(rest.iter().map(|byte| char::from(*byte)).collect()),
        },
    };
    if let Some(at) = text.find('\0') {
        let line = 1 + text[..at].matches('\n').count();
        bail!("line {line}: a zero byte, so this is no text; UTF-16 must begin with its mark");
    }
    // Lines of old spreadsheets end in a carriage return alone.
    Ok(match text.contains('\r') && !text.contains('\n') {
        true => Cow::Owned(text.replace('\r', "\n")),
        false => text,
    })
}

/// Whether the last line ends with an end-of-line.
pub fn has_ending(bytes: &[u8]) -> bool {
    let mut end = bytes.iter().rev().filter(|byte| **byte != 0);
    end.next().is_some_and(|byte| b"\r\n".contains(byte))
}

/// Whether a line has no cell with content, only separators.
pub fn is_empty(line: &str) -> bool {
    line.chars()
        .all(|c| c.is_whitespace() || SEPARATORS.contains(&c))
}

/// No data: nothing, a comment, or the line in which a spreadsheet states its separator.
pub fn is_blank(line: &str) -> bool {
    is_empty(line) || line.trim_start().starts_with(['#', '%']) || line.starts_with("sep=")
}

/// The cells of a line, without their quotes and the blanks around them.
pub fn split(line: &str, separator: char) -> Vec<String> {
    if separator == ' ' {
        return line
            .split_whitespace()
            .map(|cell| unquote(cell).into())
            .collect();
    }
    let mut quoted = false;
    line.split(|c: char| {
        quoted ^= c == '"';
        c == separator && !quoted
    })
    .map(|cell| unquote(cell).into())
    .collect()
}

fn unquote(cell: &str) -> &str {
    let cell = cell.trim();
    let inner = cell
        .strip_prefix('"')
        .and_then(|cell| cell.strip_suffix('"'));
    inner.map_or(cell, str::trim)
}
