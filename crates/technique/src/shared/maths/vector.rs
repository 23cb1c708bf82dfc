//! Vectors in single precision, as three numbers.

/// a · b.
#[inline(always)]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// v of length 1.
#[inline(always)]
pub fn normalized(v: [f32; 3]) -> [f32; 3] {
    let s = dot(v, v).sqrt().recip();
    v.map(|x| x * s)
}

/// The tangent where nothing else gives one: t = normalize(a × n), a = +Y if |n·y| < 0.99 else +X.
#[inline(always)]
pub fn tangent(n: [f32; 3]) -> [f32; 3] {
    let c = if n[1].abs() < 0.99 { [n[2], 0.0, -n[0]] } else { [0.0, -n[2], n[1]] };
    normalized(c)
}

/// The frame of a surface: tangent, bitangent and normal.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    axes: [[f32; 3]; 3],
}

impl Axes {
    /// The frame of a normal and a tangent perpendicular to it.
    #[inline(always)]
    pub fn new(n: [f32; 3], t: [f32; 3]) -> Self {
        Self { axes: [t, cross(n, t), n] }
    }

    /// The frame with its bitangent reversed where `side` is −1, as on surfaces whose texture is mirrored.
    #[inline(always)]
    pub fn sided(n: [f32; 3], t: [f32; 3], side: f32) -> Self {
        Self { axes: [t, cross(n, t).map(|x| side * x), n] }
    }

    /// A direction's components along tangent, bitangent and normal.
    #[inline(always)]
    pub fn local(&self, v: [f32; 3]) -> [f32; 3] {
        self.axes.map(|a| dot(a, v))
    }
}
