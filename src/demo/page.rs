//! The page: one HTML file that holds its pictures and its style, and beside it asks for the viewer alone.

use std::fmt::Write;

use crate::demo::names;
use crate::demo::pictures::Embedded;
use crate::demo::story::{Block, Grid, Section, Shot, Table};

/// The page of a demo; `title` is plain text. `embedded` are the pictures of all sections, in their order.
pub(super) fn render(title: &str, sections: &[Section], embedded: &[Embedded]) -> String {
    let mut embedded = embedded.iter();
    let mut links = String::new();
    let mut body = String::new();
    for (number, section) in sections.iter().enumerate() {
        let title = escape(section.title);
        // Writing to a String cannot fail.
        let _ = write!(links, "<a href=\"#s{number}\">{title}</a> ");
        let _ = write!(body, "<section id=\"s{number}\">\n<h2>{title}</h2>\n");
        for block in &section.blocks {
            body.push_str(&render_block(block, &mut embedded));
        }
        body.push_str("</section>\n");
    }
    let page_title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{page_title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<header>\n\
         <h1>{page_title}</h1>\n\
         <p>A Bidirectional Texture Function (BTF) is a material photographed from many views under many \
         lights. This page shows one run of btfkit, step by step. It cut a seamless tile from such a \
         measurement, reduced the tile to a few hundred measured reflectances, and covered a larger area with \
         them. The steps are those of Filip and Haindl, BTF modelling using BRDF texels (2007), with a newer \
         way to enlarge beside theirs.</p>\n\
         <iframe src=\"{viewer}\" title=\"The material of this page, to light and to turn\"></iframe>\n\
         <p>Drag over the material: the light moves. Its surface never ends. <a href=\"{viewer}\">See it larger</a>, or click \
         a picture below to see it in full.</p>\n\
         <nav>{links}</nav>\n</header>\n<main>\n{body}</main>\n\
         <footer>btfkit {version}. All pictures are also beside this page as PNG, in the folder \
         {pictures}.</footer>\n</body>\n</html>\n",
        style = include_str!("page.css"),
        version = env!("CARGO_PKG_VERSION"),
        pictures = names::PICTURES,
        viewer = names::VIEWER,
    )
}

fn render_block<'a>(block: &Block, embedded: &mut impl Iterator<Item = &'a Embedded>) -> String {
    match block {
        Block::Text(html) => format!("{html}\n"),
        Block::Pictures(grid, shots) => {
            let figures: String =
                shots.iter().zip(embedded).map(|(shot, embedded)| figure(shot, embedded)).collect();
            let class = match grid {
                Grid::Small => "small",
                Grid::Large => "large",
            };
            format!("<div class=\"grid {class}\">\n{figures}</div>\n")
        }
        Block::Table(table) => render_table(table),
        Block::Commands(lines) => format!("<pre><code>{}</code></pre>\n", escape(&lines.join("\n"))),
    }
}

/// Sides below this are shown magnified, each texel a square.
const TEXELS_SHOWN: usize = 300;

fn figure(shot: &Shot, Embedded { address, size }: &Embedded) -> String {
    let class = if size.height.max(size.width) < TEXELS_SHOWN { " class=\"texels\"" } else { "" };
    format!(
        "<figure><a href=\"{}/{}.png\"><img{class} src=\"{address}\" width=\"{}\" height=\"{}\" alt=\"{}\"></a>\
         <figcaption>{}</figcaption></figure>\n",
        names::PICTURES,
        escape(&shot.file),
        size.width,
        size.height,
        escape(&shot.alt),
        shot.caption
    )
}

fn render_table(Table { caption, head, rows }: &Table) -> String {
    // Columns of figures stand flush right, those with a word in them flush left.
    let is_word = |cell: &String| !cell.starts_with(|c: char| c.is_ascii_digit());
    let class = |column: usize| {
        let words = rows.iter().filter_map(|row| row.get(column)).any(is_word);
        if words { " class=\"words\"" } else { "" }
    };
    let title =
        |(number, name): (usize, &&str)| format!("<th scope=\"col\"{}>{}</th>", class(number), escape(name));
    let cell = |(number, cell): (usize, &String)| match number {
        0 => format!("<th scope=\"row\">{}</th>", escape(cell)),
        _ => format!("<td{}>{}</td>", class(number), escape(cell)),
    };
    let row = |cells: &Vec<String>| {
        format!("<tr>{}</tr>\n", cells.iter().enumerate().map(cell).collect::<String>())
    };
    format!(
        "<div class=\"scroll\"><table>\n<caption>{}</caption>\n<thead><tr>{}</tr></thead>\n\
         <tbody>\n{}</tbody>\n</table></div>\n",
        escape(caption),
        head.iter().enumerate().map(title).collect::<String>(),
        rows.iter().map(row).collect::<String>()
    )
}

/// Text as HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::pictures::{Lit, Subject};
    use crate::shape::Size;

    fn shot(name: &str) -> Shot {
        Shot {
            file: name.to_owned(),
            subject: Subject::Measured(Lit::REFERENCE),
            caption: format!("<b>{name}</b>"),
            alt: format!("\"{name}\" & more"),
        }
    }

    #[test]
    fn every_picture_stands_under_its_own_caption() {
        let pictures = |names: &[&str]| Block::Pictures(Grid::Small, names.iter().map(|n| shot(n)).collect());
        let sections = [
            Section { title: "A", blocks: vec![pictures(&["one", "two"]), pictures(&["three"])] },
            Section { title: "B & C", blocks: vec![pictures(&["four"])] },
        ];
        let embedded: Vec<Embedded> = ["one", "two", "three", "four"]
            .map(|name| Embedded { address: format!("data:{name}"), size: Size::new(1, 1) })
            .into();
        let page = render("wood", &sections, &embedded);
        for name in ["one", "two", "three", "four"] {
            let figure = format!(
                "<a href=\"pictures/{name}.png\"><img class=\"texels\" src=\"data:{name}\" width=\"1\" height=\"1\" \
                 alt=\"&quot;{name}&quot; &amp; more\"></a><figcaption><b>{name}</b>"
            );
            assert!(page.contains(&figure), "{figure}");
        }
        assert!(page.contains("<h2>B &amp; C</h2>"));
        assert!(!page.contains("http"), "the page asks for something from elsewhere");
    }
}
