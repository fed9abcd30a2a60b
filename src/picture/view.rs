use glam::{DMat3, DVec2, DVec3};

use crate::mesh::TriangleMesh;

/// From where a mesh is seen, and the size of the picture. Orthographic; at yaw 0 the viewer stands on +Z with +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Degrees the viewer has walked around +Y, towards +X.
    pub yaw: f64,
    /// Degrees the viewer has risen above the horizon.
    pub pitch: f64,
    /// Pixels in a row and in a column.
    pub size: [usize; 2],
    /// The part of space that fills the picture; `None` fits the mesh.
    pub frame: Option<Frame>,
}

/// A ball that just fits the picture. The same frame gives different meshes or views the same scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The point in the middle of the picture.
    pub centre: DVec3,
    /// Half of the picture's shorter side, in the mesh's units.
    pub radius: f64,
}

impl Frame {
    /// The frame around a mesh: the ball about the middle of its bounding box.
    pub fn around(mesh: &TriangleMesh) -> Self {
        let low = mesh.positions().iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = mesh.positions().iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = (low + high) / 2.0;
        Self { centre, radius: mesh.radius_about(centre) }
    }
}

impl View {
    /// The view from `yaw` degrees on the horizon, 500 pixels square.
    pub fn new(yaw: f64) -> Self {
        Self { yaw, pitch: 0.0, size: [500, 500], frame: None }
    }

    /// Seen from the front.
    pub fn front() -> Self {
        Self::new(0.0)
    }

    /// Seen from between front and side.
    pub fn three_quarter() -> Self {
        Self::new(40.0)
    }

    /// Seen from the side, at +X.
    pub fn side() -> Self {
        Self::new(90.0)
    }

    /// The same from `pitch` degrees above the horizon.
    pub fn pitched(self, pitch: f64) -> Self {
        Self { pitch, ..self }
    }

    /// The same in `width` times `height` pixels.
    pub fn sized(self, width: usize, height: usize) -> Self {
        Self { size: [width, height], ..self }
    }

    /// The same showing `frame`.
    pub fn framed(self, frame: Frame) -> Self {
        Self { frame: Some(frame), ..self }
    }

    /// The map from space to the picture's pixels, each split into `splits` samples a side.
    pub(super) fn projection(&self, mesh: &TriangleMesh, splits: usize) -> Projection {
        const MARGIN: f64 = 1.03;
        let frame = self.frame.unwrap_or_else(|| Frame::around(mesh));
        let [width, height] = self.size.map(|side| (side * splits) as f64);
        Projection {
            turn: DMat3::from_rotation_x(self.pitch.to_radians())
                * DMat3::from_rotation_y(-self.yaw.to_radians()),
            centre: frame.centre,
            scale: width.min(height) / (2.0 * MARGIN * frame.radius),
            middle: DVec2::new(width, height) / 2.0,
        }
    }
}

/// An orthographic projection to sample positions (columns, rows from the top) and nearness to the viewer.
pub(super) struct Projection {
    turn: DMat3,
    centre: DVec3,
    /// Samples per unit of length.
    pub scale: f64,
    middle: DVec2,
}

impl Projection {
    /// Column, row and nearness, all in samples.
    pub fn point(&self, position: DVec3) -> DVec3 {
        let seen = self.turn * (position - self.centre) * self.scale;
        DVec3::new(self.middle.x + seen.x, self.middle.y - seen.y, seen.z)
    }

    /// A direction as the viewer sees it: x right, y up, z towards them.
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.turn * direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn puts_the_side_in_front() {
        let mesh = TriangleMesh::new(vec![DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 1, 2]]).unwrap();
        let frame = Frame { centre: DVec3::ZERO, radius: 1.0 };
        let side = View::side().framed(frame).projection(&mesh, 1);
        assert!(side.direction(DVec3::X).distance(DVec3::Z) < 1e-12);
        assert!(side.point(DVec3::Y).y < 250.0, "+Y is up");
        let above = View::front().pitched(90.0).framed(frame).projection(&mesh, 1);
        assert!(above.direction(DVec3::Y).distance(DVec3::Z) < 1e-12);
    }
}
