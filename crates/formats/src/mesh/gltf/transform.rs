//! Node transforms.

use super::json::Node;

/// An affine map: the images of the axes, and the translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    columns: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Affine {
    /// Leaves all where it is.
    pub const IDENTITY: Self =
        Self { columns: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// A node's own transform: its matrix (column-major), or T·R·S.
    pub fn of(node: &Node) -> Self {
        if let Some(m) = node.matrix {
            let column = |i: usize| [m[4 * i], m[4 * i + 1], m[4 * i + 2]];
            return Self { columns: [column(0), column(1), column(2)], translation: column(3) };
        }
        let [x, y, z, w] = unit(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let [sx, sy, sz] = node.scale.unwrap_or([1.0; 3]);
        let columns = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)].map(|v| v * sx),
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)].map(|v| v * sy),
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)].map(|v| v * sz),
        ];
        Self { columns, translation: node.translation.unwrap_or_default() }
    }

    /// `self` after `inner`.
    pub fn after(&self, inner: &Self) -> Self {
        let columns = inner.columns.map(|c| self.linear(c));
        Self { columns, translation: self.point64(inner.translation) }
    }

    fn linear(&self, v: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| (0..3).map(|i| self.columns[i][k] * v[i]).sum())
    }

    fn point64(&self, p: [f64; 3]) -> [f64; 3] {
        let q = self.linear(p);
        [0, 1, 2].map(|k| q[k] + self.translation[k])
    }

    /// Where a point goes.
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        self.point64(p.map(f64::from)).map(|v| v as f32)
    }

    /// Where a direction along the surface goes (not normalised).
    pub fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        self.linear(v.map(f64::from)).map(|v| v as f32)
    }

    /// Where a normal goes: by the inverse transpose, unit length.
    pub fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        let [a, b, c] = self.columns;
        let sign = if self.mirrors() { -1.0 } else { 1.0 };
        // The cofactor matrix is det · inverse transpose, and exists for singular maps too.
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let n = n.map(f64::from);
        let m: [f64; 3] = [0, 1, 2].map(|k| sign * (0..3).map(|i| cofactors[i][k] * n[i]).sum::<f64>());
        let length = m.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length > 0.0 { m.map(|v| (v / length) as f32) } else { [0.0; 3] }
    }

    /// Is the determinant negative?
    pub fn mirrors(&self) -> bool {
        let [a, b, c] = self.columns;
        let d = cross(b, c);
        a[0] * d[0] + a[1] * d[1] + a[2] * d[2] < 0.0
    }

    /// Are all its numbers finite?
    pub fn is_finite(&self) -> bool {
        self.columns.iter().flatten().chain(&self.translation).all(|v| v.is_finite())
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length > 0.0 { q.map(|v| v / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_y_takes_z_to_x() {
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let node = Node {
            rotation: Some([0.0, h, 0.0, h]),
            scale: Some([1.0, 2.0, 3.0]),
            translation: Some([0.0, 5.0, 0.0]),
            ..Node::default()
        };
        let m = Affine::of(&node);
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-6);
        assert!(close(m.point([0.0, 1.0, 1.0]), [3.0, 7.0, 0.0]));
        assert!(
            close(m.normal([0.0, 0.6, 0.8]), [0.664_363_8, 0.747_409_3, 0.0]),
            "{:?}",
            m.normal([0.0, 0.6, 0.8])
        );
        let twice = m.after(&m);
        assert!(close(twice.point([0.0, 0.0, 1.0]), [0.0, 15.0, -3.0]));
    }

    #[test]
    fn a_mirror_keeps_normals_on_their_side() {
        let m = Affine::of(&Node { scale: Some([-1.0, 1.0, 1.0]), ..Node::default() });
        assert!(m.mirrors());
        assert_eq!(m.normal([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(m.normal([1.0, 0.0, 0.0]), [-1.0, 0.0, 0.0]);
    }
}
