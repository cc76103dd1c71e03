//! Reads a page: its tags must be closed, it must need nothing from elsewhere, and it gives its tables and pictures.

use base64::Engine;
use quick_xml::Reader;
use quick_xml::events::Event;
use std::collections::BTreeMap;

/// Elements of HTML that have no end tag.
const VOID: [&str; 3] = ["meta", "link", "img"];

/// A page that was read.
pub struct Page {
    /// The content of `h1`.
    pub heading: String,
    /// Rows with a header cell: its text, and that of the cell after it.
    pub rows: BTreeMap<String, String>,
    /// The texts of all cells, row by row.
    pub table: Vec<Vec<String>>,
    /// All text.
    pub text: String,
    /// The PNG files of its pictures.
    pub pictures: Vec<Vec<u8>>,
}

/// A decoded picture.
pub struct Pixels {
    pub width: u32,
    pub rgba: Vec<u8>,
}

impl Page {
    pub fn of(html: &str) -> Self {
        let lower = html.to_lowercase();
        for outside in [
            "http:",
            "https:",
            "<script",
            "url(",
            "@import",
            "onload",
            "<iframe",
            "javascript:",
        ] {
            assert!(!lower.contains(outside), "{outside}");
        }
        let html = html.strip_prefix("<!DOCTYPE html>").unwrap();
        let mut reader = Reader::from_str(html);
        reader.config_mut().check_end_names = false;
        let mut page = Self {
            heading: String::new(),
            rows: BTreeMap::new(),
            table: Vec::new(),
            text: String::new(),
            pictures: Vec::new(),
        };
        let (mut open, mut text): (Vec<String>, String) = (Vec::new(), String::new());
        loop {
            match reader.read_event().unwrap() {
                Event::Start(start) => {
                    let name = start.name().as_ref().to_owned();
                    for attribute in start.attributes() {
                        let attribute = attribute.unwrap();
                        let value = attribute.value.to_string();
                        match attribute.key.as_ref() {
                            "src" => page.pictures.push(embedded(&value)),
                            "href" => assert_eq!(value, "data:,"),
                            key => assert!(!key.starts_with("on"), "{attribute:?}"),
                        }
                    }
                    if ["th", "td", "h1", "tr"].contains(&name.as_str()) {
                        text.clear();
                    }
                    if name == "tr" {
                        page.table.push(Vec::new());
                    }
                    if !VOID.contains(&name.as_str()) {
                        open.push(name);
                    }
                }
                Event::End(end) => {
                    let name = end.name().as_ref().to_owned();
                    assert_eq!(open.pop().as_ref(), Some(&name));
                    let own = text.trim().to_owned();
                    match name.as_str() {
                        "h1" => page.heading = own,
                        "th" | "td" => {
                            if let Some(row) = page.table.last_mut() {
                                row.push(own);
                            }
                        }
                        _ => {}
                    }
                }
                Event::Text(more) => {
                    let more = more.xml_content(quick_xml::XmlVersion::Implicit1_0);
                    text += &more;
                    page.text += &more;
                }
                Event::GeneralRef(name) => {
                    let name: &str = &name;
                    let known = [("amp", "&"), ("lt", "<"), ("gt", ">"), ("quot", "\"")];
                    let found = known.iter().find(|known| known.0 == name);
                    let found = found.unwrap_or_else(|| panic!("{name}")).1;
                    text += found;
                    page.text += found;
                }
                Event::Eof => break,
                other => panic!("{other:?}"),
            }
        }
        assert!(open.is_empty(), "{open:?}");
        let rows: Vec<_> = page.table.iter().filter(|row| row.len() == 2).collect();
        let rows = rows.into_iter();
        for row in rows.map(|row| (row[0].clone(), row[1].clone())).rev() {
            // Of several rows with one name the first.
            page.rows.insert(row.0, row.1);
        }
        page
    }

    /// The number in the row `name`; digits are not grouped in the text.
    pub fn number(&self, name: &str) -> u64 {
        let row = self
            .rows
            .get(name)
            .unwrap_or_else(|| panic!("{name} in {:?}", self.rows));
        let digits = row.split(' ').next().unwrap();
        digits.parse().unwrap_or_else(|_| panic!("{name}: {row}"))
    }

    /// The decoded pictures.
    pub fn pixels(&self) -> Vec<Pixels> {
        self.pictures.iter().map(|png| decoded(png)).collect()
    }
}

fn embedded(source: &str) -> Vec<u8> {
    let data = source.strip_prefix("data:image/png;base64,").unwrap();
    base64::engine::general_purpose::STANDARD
        .decode(data)
        .unwrap()
}

/// Decodes a picture with an opacity.
pub fn decoded(png: &[u8]) -> Pixels {
    let decoder = png::Decoder::new(std::io::Cursor::new(png));
    let mut reader = decoder.read_info().unwrap();
    let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgba).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgba);
    Pixels {
        width: info.width,
        rgba,
    }
}

impl Pixels {
    /// Share of the pixels that show something.
    pub fn filled(&self) -> f64 {
        let seen = self.rgba.chunks_exact(4).filter(|p| p[3] > 0).count();
        seen as f64 * 4.0 / self.rgba.len() as f64
    }

    /// Number of pixels with some red of boundary edges.
    pub fn reddish(&self) -> usize {
        let is = |p: &&[u8]| p[3] > 0 && i32::from(p[0]) - i32::from(p[1].max(p[2])) > 60;
        self.rgba.chunks_exact(4).filter(is).count()
    }

    /// Number of opaque pixels with this colour.
    pub fn of(&self, colour: [u8; 3]) -> usize {
        let is = |p: &&[u8]| p[..3] == colour && p[3] == 255;
        self.rgba.chunks_exact(4).filter(is).count()
    }
}
