//! Images as plain data.

/// One plane of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// "R", "G", "B", "A", "Y", or the file's own name ("layer.R").
    pub name: String,
    /// Rows from the top, `width·height` values.
    pub data: Vec<f32>,
}

/// A decoded image: named planes of f32, linear.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Raster {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The planes.
    pub channels: Vec<Channel>,
    /// True where the file holds low-range (8- or 16-bit display-referred) data that was decoded from sRGB.
    pub low_range: bool,
    /// Metadata as text, in file order.
    pub metadata: Vec<(String, String)>,
}

impl Raster {
    /// An RGB image from three planes.
    pub fn rgb(width: usize, height: usize, planes: [Vec<f32>; 3]) -> Self {
        let channels = ["R", "G", "B"]
            .into_iter()
            .zip(planes)
            .map(|(name, data)| Channel { name: name.into(), data })
            .collect();
        Self { width, height, channels, low_range: false, metadata: Vec::new() }
    }

    /// The plane called `name`.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.data.as_slice())
    }

    /// The first pixel (in rows from the top) that is NaN or infinite, with its channel's name.
    pub fn first_non_finite(&self) -> Option<(usize, usize, &str)> {
        let first = |c: &Channel| c.data.iter().position(|v| !v.is_finite());
        let (i, channel) =
            self.channels.iter().filter_map(|c| Some((first(c)?, c))).min_by_key(|&(i, _)| i)?;
        Some((i % self.width.max(1), i / self.width.max(1), &channel.name))
    }

    /// Red, green and blue, moved out; a single luminance plane serves as all three. `None` where there is
    /// neither.
    pub fn into_rgb(mut self) -> Option<[Vec<f32>; 3]> {
        let mut take = |name: &str| {
            let i = self.channels.iter().position(|c| c.name == name)?;
            Some(std::mem::take(&mut self.channels[i].data))
        };
        if let (Some(r), Some(g), Some(b)) = (take("R"), take("G"), take("B")) {
            return Some([r, g, b]);
        }
        let y = take("Y")?;
        Some([y.clone(), y.clone(), y])
    }
}
