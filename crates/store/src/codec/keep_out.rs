//! Encoding of keep-outs and of their changes.

use super::change::{caller_from, text_of};
use super::unreadable::{Unreadable, required};
use crate::pb;
use mrol_map::geometry::{self, rotation_xyzw, translation_m};
use mrol_map::map::{
    KeepOut, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, Prism, Region, Request,
};

impl From<&KeepOutRecord> for pb::KeepOutChange {
    fn from(KeepOutRecord { change, request }: &KeepOutRecord) -> Self {
        use pb::keep_out_change::Act;
        let act = match &change.act {
            KeepOutAct::Put { shape, made_by, expires_at_ns } => Act::Put(pb::KeepOutPut {
                shape: Some(shape.into()),
                made_by: text_of(made_by.as_ref()),
                expires_at_ns: *expires_at_ns,
            }),
            KeepOutAct::Removed { by } => Act::Removal(pb::KeepOutRemoval { by: text_of(by.as_ref()) }),
            KeepOutAct::Expired => Act::Expiry(pb::KeepOutExpiry {}),
        };
        Self { name: change.name.to_string(), act: Some(act), request: request.as_ref().map(Into::into) }
    }
}

impl TryFrom<pb::KeepOutChange> for KeepOutRecord {
    type Error = Unreadable;

    fn try_from(message: pb::KeepOutChange) -> Result<Self, Unreadable> {
        use pb::keep_out_change::Act;
        let act = match required(message.act, "keep_out.act")? {
            Act::Put(pb::KeepOutPut { shape, made_by, expires_at_ns }) => KeepOutAct::Put {
                shape: required(shape, "keep_out.put.shape")?.try_into()?,
                made_by: caller_from(&made_by)?,
                expires_at_ns,
            },
            Act::Removal(pb::KeepOutRemoval { by }) => KeepOutAct::Removed { by: caller_from(&by)? },
            Act::Expiry(pb::KeepOutExpiry {}) => KeepOutAct::Expired,
        };
        Ok(Self {
            change: KeepOutChange { name: name_from(&message.name)?, act },
            request: message.request.map(Request::try_from).transpose()?,
        })
    }
}

impl From<&KeepOut> for pb::KeepOut {
    fn from(keep_out: &KeepOut) -> Self {
        let put = pb::KeepOutPut {
            shape: Some((&keep_out.shape).into()),
            made_by: text_of(keep_out.made_by.as_ref()),
            expires_at_ns: keep_out.expires_at_ns,
        };
        Self { name: keep_out.name.to_string(), put: Some(put), made_revision: keep_out.made_revision }
    }
}

impl TryFrom<pb::KeepOut> for KeepOut {
    type Error = Unreadable;

    fn try_from(message: pb::KeepOut) -> Result<Self, Unreadable> {
        let pb::KeepOutPut { shape, made_by, expires_at_ns } = required(message.put, "keep_outs.put")?;
        Ok(Self {
            name: name_from(&message.name)?,
            shape: required(shape, "keep_outs.put.shape")?.try_into()?,
            made_by: caller_from(&made_by)?,
            made_revision: message.made_revision,
            expires_at_ns,
        })
    }
}

impl From<&KeepOutShape> for pb::KeepOutShape {
    fn from(shape: &KeepOutShape) -> Self {
        use pb::keep_out_shape::Shape;
        let numbers = |numbers: Vec<f64>| pb::Numbers { numbers };
        let shape = match shape {
            KeepOutShape::Region(Region::Box { min_m, max_m }) => {
                Shape::Box(numbers([*min_m, *max_m].concat()))
            }
            KeepOutShape::Region(Region::Sphere { center_m, radius_m }) => {
                Shape::Sphere(numbers([&center_m[..], &[*radius_m]].concat()))
            }
            KeepOutShape::Region(Region::OrientedBox(of)) => {
                let (center_m, turned) = (translation_m(of.map_from_box()), rotation_xyzw(of.map_from_box()));
                Shape::OrientedBox(numbers([&center_m[..], &turned, &of.size_m()].concat()))
            }
            KeepOutShape::Prism(prism) => {
                Shape::Prism(numbers([&prism.z_m()[..], prism.corners_m().as_flattened()].concat()))
            }
        };
        Self { shape: Some(shape) }
    }
}

impl TryFrom<pb::KeepOutShape> for KeepOutShape {
    type Error = Unreadable;

    fn try_from(message: pb::KeepOutShape) -> Result<Self, Unreadable> {
        use pb::keep_out_shape::Shape;
        match required(message.shape, "the keep-out's shape, or known to this version,")? {
            Shape::Box(of) => {
                let [x0, y0, z0, x1, y1, z1] = exactly(&of, "box")?;
                of_region(Region::cuboid([x0, y0, z0], [x1, y1, z1]))
            }
            Shape::Sphere(of) => {
                let [x, y, z, radius_m] = exactly(&of, "sphere")?;
                of_region(Region::ball([x, y, z], radius_m))
            }
            Shape::OrientedBox(of) => {
                let [x, y, z, qx, qy, qz, qw, sx, sy, sz] = exactly(&of, "oriented_box")?;
                let placed = geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|e| e.to_string())?;
                of_region(Region::oriented_box(placed, [sx, sy, sz]))
            }
            Shape::Prism(of) => {
                let (heights, corners) = of.numbers.split_first_chunk().ok_or("the prism has no heights")?;
                let (corners, []) = corners.as_chunks() else {
                    return Err("the prism has half a corner".into());
                };
                Prism::new(corners, *heights).map(Self::Prism).map_err(|e| e.to_string())
            }
        }
    }
}

fn of_region<E: ToString>(region: Result<Region, E>) -> Result<KeepOutShape, Unreadable> {
    KeepOutShape::of_region(region.map_err(|e| e.to_string())?).map_err(|e| e.to_string())
}

fn exactly<const N: usize>(of: &pb::Numbers, shape: &str) -> Result<[f64; N], Unreadable> {
    let count = of.numbers.len();
    of.numbers[..]
        .try_into()
        .map_err(|_| format!("the {shape} of a keep-out has {count} numbers, {N} are one"))
}

fn name_from(text: &str) -> Result<KeepOutName, Unreadable> {
    KeepOutName::new(text).map_err(|e| e.to_string())
}
