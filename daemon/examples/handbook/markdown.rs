//! A manual page from one of our documents: headings, paragraphs, tables and blocks of code.

use clap_mangen::roff::{Inline, Roff, bold, roman};

/// The page `name(section)` from `text`, whose first heading and paragraph tell what it is about.
pub(crate) fn to_man(name: &str, section: &str, text: &str) -> String {
    let mut roff = Roff::new();
    roff.control("TH", [name, section, "", concat!("axisd ", env!("CARGO_PKG_VERSION")), "axisd"]);
    roff.control("SH", ["NAME"]);
    let mut blocks = blocks(text).into_iter();
    if let Some(Block::Heading(_, title)) = blocks.next() {
        roff.text([roman(format!("{name} - {}", title.to_lowercase()))]);
    }
    roff.control("SH", ["DESCRIPTION"]);
    for block in blocks {
        match block {
            Block::Heading(1..=2, text) => roff.control("SH", [text.as_str()]),
            Block::Heading(_, text) => roff.control("SS", [text.as_str()]),
            Block::Paragraph(text) => roff.control("PP", []).text(inlines(&text)),
            Block::Code(lines) => {
                roff.control("PP", []).control("RS", ["4"]).control("nf", []);
                for line in lines {
                    roff.text([roman(line)]);
                }
                roff.control("fi", []).control("RE", [])
            }
            Block::Table(rows) => {
                rows.iter().for_each(|row| entry(&mut roff, row));
                &mut roff
            }
        };
    }
    roff.control("SH", ["SEE ALSO"]);
    roff.text([bold("axisd(8), axisctl(1)")]);
    roff.render()
}

enum Block {
    /// With its level.
    Heading(usize, String),
    Paragraph(String),
    Code(Vec<String>),
    /// The cells of each row, without the head.
    Table(Vec<Vec<String>>),
}

fn blocks(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.is_empty() {
            continue;
        } else if line.starts_with("```") {
            blocks.push(Block::Code(
                lines.by_ref().take_while(|line| *line != "```").map(str::to_owned).collect(),
            ));
        } else if line.starts_with('#') {
            let title = line.trim_start_matches('#');
            blocks.push(Block::Heading(line.len() - title.len(), title.trim().to_owned()));
        } else {
            let mut block = vec![line];
            while let Some(line) = lines.next_if(|line| !line.is_empty()) {
                block.push(line);
            }
            let is_table = line.starts_with('|');
            blocks.push(if is_table { table(&block) } else { Block::Paragraph(block.join(" ")) });
        }
    }
    blocks
}

fn table(lines: &[&str]) -> Block {
    const HEAD: usize = 2;
    let cells = |line: &&str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    Block::Table(lines.iter().skip(HEAD).map(cells).collect())
}

/// A row as an entry of a list: the first cell above the others.
fn entry(roff: &mut Roff, row: &[String]) {
    let Some((term, [value, default, meaning])) = row.split_first() else {
        panic!("not a key with value, default and meaning: {row:?}");
    };
    roff.control("TP", []);
    roff.text(inlines(term));
    roff.text(inlines(meaning));
    roff.control("br", []);
    roff.text(inlines(&format!("Value: {value}. Default: {default}.")));
}

/// Text in which `code` is bold and of a [link](target) the text remains.
fn inlines(text: &str) -> Vec<Inline> {
    let mut plain = String::new();
    for (number, part) in text.split("](").enumerate() {
        let part = if number == 0 { part } else { part.split_once(')').map_or(part, |(_, rest)| rest) };
        plain += part;
    }
    let piece = |(number, piece): (usize, &str)| {
        if number % 2 == 1 { bold(piece) } else { roman(piece.replace(" [", " ")) }
    };
    plain.split('`').enumerate().map(piece).collect()
}
