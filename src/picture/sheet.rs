use super::{Colour, Image, text};

/// Pixels between tiles and around the sheet.
const GAP: usize = 8;
/// Pixels a dot of the captions and of the title.
const CAPTION: usize = 2;
const TITLE: usize = 3;

/// A contact sheet: rows of captioned images under a title.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    title: String,
    rows: Vec<Vec<(String, Image)>>,
}

impl Sheet {
    /// An empty sheet; an empty title takes no room.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), rows: Vec::new() }
    }

    /// Adds a row of images, each with the caption above it.
    pub fn row<C: Into<String>>(&mut self, tiles: impl IntoIterator<Item = (C, Image)>) {
        self.rows.push(tiles.into_iter().map(|(caption, image)| (caption.into(), image)).collect());
    }

    /// The sheet as one image.
    pub fn image(&self) -> Image {
        let width = self.rows.iter().map(|row| row_width(row)).max().unwrap_or(0);
        let width = width.max(text::size(&self.title, TITLE)[0]) + GAP;
        let height = self.rows.iter().map(|row| row_height(row)).sum::<usize>() + self.title_height() + GAP;
        let mut image = Image::filled(width, height, Colour::WHITE);
        text::write(&mut image, &self.title, GAP, GAP, TITLE);
        let mut top = self.title_height() + GAP;
        for row in &self.rows {
            paste_row(&mut image, row, top);
            top += row_height(row);
        }
        image
    }

    fn title_height(&self) -> usize {
        if self.title.is_empty() { 0 } else { text::size(&self.title, TITLE)[1] + 2 * GAP }
    }
}

fn paste_row(image: &mut Image, row: &[(String, Image)], top: usize) {
    let below = text::size("", CAPTION)[1] + GAP / 2;
    let mut left = GAP;
    for (caption, tile) in row {
        text::write(image, caption, left, top, CAPTION);
        image.paste(tile, left, top + below);
        left += tile_width(caption, tile) + GAP;
    }
}

fn tile_width(caption: &str, tile: &Image) -> usize {
    tile.width().max(text::size(caption, CAPTION)[0])
}

fn row_width(row: &[(String, Image)]) -> usize {
    GAP + row.iter().map(|(caption, tile)| tile_width(caption, tile) + GAP).sum::<usize>()
}

fn row_height(row: &[(String, Image)]) -> usize {
    let tallest = row.iter().map(|(_, tile)| tile.height()).max().unwrap_or(0);
    text::size("", CAPTION)[1] + GAP / 2 + tallest + GAP
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_every_tile_and_letter() {
        let mut sheet = Sheet::new("Title");
        let tile = |hex| Image::filled(50, 40, Colour::srgb(hex));
        sheet.row([("red", tile(0xff0000)), ("green", tile(0x00ff00))]);
        sheet.row([("blue", tile(0x0000ff))]);
        let image = sheet.image();
        let count = |bytes| {
            let pixels = (0..image.width()).flat_map(|x| (0..image.height()).map(move |y| (x, y)));
            pixels.filter(|&(x, y)| image.pixel(x, y) == bytes).count()
        };
        for bytes in [[255, 0, 0], [0, 255, 0], [0, 0, 255]] {
            assert_eq!(count(bytes), 2000);
        }
        assert!(count([0x33; 3]) > 200, "the letters");
    }
}
