//! Keep-outs (`keep_out.proto`).

use super::pb;
use super::values::{InField, request_id_from, required, text_of};
use mrol_map::map::{
    CallerName, KeepOut, KeepOutAct, KeepOutChange, KeepOutName, KeepOutShape, MapName, Prism, Region,
};
use mrol_service::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut, Reason, ServiceError};

impl TryFrom<pb::PutKeepOutRequest> for (MapName, PutKeepOut) {
    type Error = ServiceError;

    fn try_from(request: pb::PutKeepOutRequest) -> Result<Self, ServiceError> {
        let put = PutKeepOut {
            name: KeepOutName::new(&request.name)?,
            shape: required(request.shape, "shape")?.try_into()?,
            expires_at_ns: request.expires_at_ns,
            request_id: request_id_from(&request.request_id)?,
        };
        Ok((MapName::new(&request.map)?, put))
    }
}

impl From<(&MapName, PutKeepOut)> for pb::PutKeepOutRequest {
    fn from((map, put): (&MapName, PutKeepOut)) -> Self {
        Self {
            map: map.to_string(),
            name: put.name.to_string(),
            shape: Some(put.shape.into()),
            expires_at_ns: put.expires_at_ns,
            request_id: text_of(put.request_id),
        }
    }
}

impl TryFrom<pb::DeleteKeepOutRequest> for (MapName, DeleteKeepOut) {
    type Error = ServiceError;

    fn try_from(request: pb::DeleteKeepOutRequest) -> Result<Self, ServiceError> {
        let name = KeepOutName::new(&request.name)?;
        let request_id = request_id_from(&request.request_id)?;
        Ok((MapName::new(&request.map)?, DeleteKeepOut { name, request_id }))
    }
}

impl From<(&MapName, DeleteKeepOut)> for pb::DeleteKeepOutRequest {
    fn from((map, DeleteKeepOut { name, request_id }): (&MapName, DeleteKeepOut)) -> Self {
        Self { map: map.to_string(), name: name.to_string(), request_id: text_of(request_id) }
    }
}

impl From<KeepOutAnswer> for pb::PutKeepOutResponse {
    fn from(KeepOutAnswer { version, replayed }: KeepOutAnswer) -> Self {
        Self { version: Some(version.into()), replayed }
    }
}

impl From<KeepOutAnswer> for pb::DeleteKeepOutResponse {
    fn from(KeepOutAnswer { version, replayed }: KeepOutAnswer) -> Self {
        Self { version: Some(version.into()), replayed }
    }
}

impl TryFrom<pb::PutKeepOutResponse> for KeepOutAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::PutKeepOutResponse) -> Result<Self, ServiceError> {
        let version = required(answer.version, "version")?.try_into()?;
        Ok(Self { version, replayed: answer.replayed })
    }
}

impl TryFrom<pb::DeleteKeepOutResponse> for KeepOutAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::DeleteKeepOutResponse) -> Result<Self, ServiceError> {
        let version = required(answer.version, "version")?.try_into()?;
        Ok(Self { version, replayed: answer.replayed })
    }
}

impl From<KeepOutList> for pb::ListKeepOutsResponse {
    fn from(KeepOutList { keep_outs, version }: KeepOutList) -> Self {
        let keep_outs = keep_outs.into_iter().map(Into::into).collect();
        Self { keep_outs, version: Some(version.into()) }
    }
}

impl TryFrom<pb::ListKeepOutsResponse> for KeepOutList {
    type Error = ServiceError;

    fn try_from(answer: pb::ListKeepOutsResponse) -> Result<Self, ServiceError> {
        let keep_outs = answer.keep_outs.into_iter().map(TryInto::try_into);
        let version = required(answer.version, "version")?.try_into()?;
        Ok(Self { keep_outs: keep_outs.collect::<Result<_, _>>()?, version })
    }
}

impl From<KeepOut> for pb::KeepOut {
    fn from(keep_out: KeepOut) -> Self {
        let KeepOut { name, shape, made_by, made_revision, expires_at_ns } = keep_out;
        let (name, shape, made_by) = (name.to_string(), Some(shape.into()), caller_text(made_by));
        Self { name, shape, made_by, made_revision, expires_at_ns }
    }
}

impl TryFrom<pb::KeepOut> for KeepOut {
    type Error = ServiceError;

    fn try_from(keep_out: pb::KeepOut) -> Result<Self, ServiceError> {
        Ok(Self {
            name: KeepOutName::new(&keep_out.name)?,
            shape: required(keep_out.shape, "keep_out.shape")?.try_into()?,
            made_by: caller_from(&keep_out.made_by)?,
            made_revision: keep_out.made_revision,
            expires_at_ns: keep_out.expires_at_ns,
        })
    }
}

impl TryFrom<pb::KeepOutShape> for KeepOutShape {
    type Error = ServiceError;

    fn try_from(shape: pb::KeepOutShape) -> Result<Self, ServiceError> {
        match required(shape.shape, "shape.shape")? {
            pb::keep_out_shape::Shape::Region(region) => {
                Self::of_region(Region::try_from(region)?).in_field("shape.region")
            }
            pb::keep_out_shape::Shape::Prism(pb::Prism { corners_m, z_from_m, z_to_m }) => {
                let (corners, rest) = corners_m.as_chunks();
                if !rest.is_empty() {
                    let count = corners_m.len();
                    let message =
                        format!("shape: prism.corners_m must be two numbers a corner, got {count} numbers");
                    return Err(ServiceError::new(Reason::BadKeepOut, message));
                }
                Prism::new(corners, [z_from_m, z_to_m]).map(Self::Prism).in_field("shape")
            }
        }
    }
}

impl From<KeepOutShape> for pb::KeepOutShape {
    fn from(shape: KeepOutShape) -> Self {
        use pb::keep_out_shape::Shape;
        let shape = match shape {
            KeepOutShape::Region(region) => Shape::Region(region.into()),
            KeepOutShape::Prism(prism) => {
                let [z_from_m, z_to_m] = prism.z_m();
                let corners_m = prism.corners_m().as_flattened().to_vec();
                Shape::Prism(pb::Prism { corners_m, z_from_m, z_to_m })
            }
        };
        Self { shape: Some(shape) }
    }
}

/// A change of a keep-out that made `revision`.
impl From<(KeepOutChange, u64)> for pb::WatchedKeepOut {
    fn from((KeepOutChange { name, act }, revision): (KeepOutChange, u64)) -> Self {
        use pb::watched_keep_out::Act;
        let act = match act {
            KeepOutAct::Put { shape, made_by, expires_at_ns } => {
                let (name, made_revision) = (name.clone(), revision);
                Act::Put(KeepOut { name, shape, made_by, made_revision, expires_at_ns }.into())
            }
            KeepOutAct::Removed { by } => Act::Removed(pb::WatchedKeepOutRemoval { by: caller_text(by) }),
            KeepOutAct::Expired => Act::Expired(pb::WatchedKeepOutExpiry {}),
        };
        Self { name: name.to_string(), act: Some(act) }
    }
}

impl TryFrom<pb::WatchedKeepOut> for KeepOutChange {
    type Error = ServiceError;

    fn try_from(change: pb::WatchedKeepOut) -> Result<Self, ServiceError> {
        use pb::watched_keep_out::Act;
        let act = match required(change.act, "keep_out.act")? {
            Act::Put(put) => {
                let KeepOut { shape, made_by, expires_at_ns, .. } = put.try_into()?;
                KeepOutAct::Put { shape, made_by, expires_at_ns }
            }
            Act::Removed(pb::WatchedKeepOutRemoval { by }) => KeepOutAct::Removed { by: caller_from(&by)? },
            Act::Expired(pb::WatchedKeepOutExpiry {}) => KeepOutAct::Expired,
        };
        Ok(Self { name: KeepOutName::new(&change.name)?, act })
    }
}

fn caller_text(caller: Option<CallerName>) -> String {
    caller.map(|caller| caller.as_str().to_owned()).unwrap_or_default()
}

fn caller_from(text: &str) -> Result<Option<CallerName>, ServiceError> {
    Ok((!text.is_empty()).then(|| CallerName::new(text)).transpose()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry;

    fn shapes() -> Vec<KeepOutShape> {
        let turned = geometry::pose([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8]).unwrap();
        let regions = [
            Region::cuboid([0.0; 3], [1.0; 3]),
            Region::ball([1.0; 3], 2.0),
            Region::oriented_box(turned, [1.0, 2.0, 0.5]),
        ];
        let prism = Prism::new(&[[0.0, 0.0], [3.0, 0.5], [1.0, 1.0 / 3.0]], [-1.0, 0.1]).unwrap();
        let regions = regions.map(|region| KeepOutShape::of_region(region.unwrap()).unwrap());
        regions.into_iter().chain([KeepOutShape::Prism(prism)]).collect()
    }

    #[test]
    fn keep_outs_and_their_changes_survive_the_wire() {
        let caller = Some(CallerName::new("ops").unwrap());
        for shape in shapes() {
            let name = KeepOutName::new("dock").unwrap();
            let (made_by, expires_at_ns) = (caller.clone(), Some(-5));
            let put = KeepOutAct::Put { shape: shape.clone(), made_by: made_by.clone(), expires_at_ns };
            let keep_out = KeepOut { name: name.clone(), shape, made_by, made_revision: 7, expires_at_ns };
            assert_eq!(KeepOut::try_from(pb::KeepOut::from(keep_out.clone())).unwrap(), keep_out);
            for act in [put, KeepOutAct::Removed { by: caller.clone() }, KeepOutAct::Expired] {
                let change = KeepOutChange { name: name.clone(), act };
                let sent = pb::WatchedKeepOut::from((change.clone(), 7));
                assert_eq!(KeepOutChange::try_from(sent).unwrap(), change);
            }
        }
    }

    #[test]
    fn a_shape_that_is_none_is_named() {
        let said = |shape: Option<pb::keep_out_shape::Shape>| {
            KeepOutShape::try_from(pb::KeepOutShape { shape }).unwrap_err().message
        };
        let prism = |corners_m: Vec<f64>| {
            said(Some(pb::keep_out_shape::Shape::Prism(pb::Prism { corners_m, z_from_m: 0.0, z_to_m: 1.0 })))
        };
        assert_eq!(said(None), "shape.shape is missing");
        assert!(prism(vec![0.0; 7]).contains("two numbers a corner, got 7 numbers"));
        assert!(prism(vec![0.0; 4]).starts_with("shape: prism.corners_m must be 3 to 64 corners, got 2"));
    }
}
