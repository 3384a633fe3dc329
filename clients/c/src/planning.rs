//! The functions of planners' questions.

use crate::abi::{Answer, Error, ReplicaHandle};
use crate::bodies::{BODIES, BodyHandle, LinkParts};
use crate::guarded;
use crate::memory::Out;
use crate::questions::{
    self, ClassifyPlaces, ClassifyQuestion, CollisionPlaces, FrontierPlaces, FrontierQuestion, GridPlaces,
    GridQuestion, MotionCheck, MotionPlaces, NearestPlaces, NearestQuestion, PoseCheck, RayPlaces,
    RayQuestion, SphereCheck,
};

/// Makes a body: `mrol_body_new` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_body_new(
    links: *const LinkParts,
    links_count: usize,
    body: *mut BodyHandle,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(body, "body"), Out::of(error, "error")) };
    guarded(error, || {
        let out = out.required()?;
        out.write(BodyHandle::NONE);
        // SAFETY: as the caller promises.
        out.write(unsafe { BODIES.make(links, links_count) }?);
        Ok(())
    })
}

/// Frees a body: `mrol_body_free` of mrol.h.
///
/// # Safety
/// `error` is NULL or points to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_body_free(body: BodyHandle, error: *mut Error) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || BODIES.free(body))
}

/// Makes a function that asks in the regular form.
macro_rules! question {
    ($(#[doc = $doc:literal] $name:ident: $question:ident => $answers:ident;)+) => {
        $(#[doc = $doc]
        ///
        /// # Safety
        /// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            replica: ReplicaHandle,
            question: *const $question,
            answers: *const $answers,
            answer: *mut Answer,
            error: *mut Error,
        ) -> i32 {
            // SAFETY: as the caller promises.
            unsafe { questions::ask(replica, question, answers, answer, error) }
        })+
    };
}

question! {
    #[doc = "Checks poses of a body: `mrol_replica_check_poses` of mrol.h."]
    mrol_replica_check_poses: PoseCheck => CollisionPlaces;
    #[doc = "Checks spheres: `mrol_replica_check_spheres` of mrol.h."]
    mrol_replica_check_spheres: SphereCheck => CollisionPlaces;
    #[doc = "Checks motions of a body: `mrol_replica_check_motions` of mrol.h."]
    mrol_replica_check_motions: MotionCheck => MotionPlaces;
    #[doc = "Casts rays: `mrol_replica_cast_rays` of mrol.h."]
    mrol_replica_cast_rays: RayQuestion => RayPlaces;
    #[doc = "Finds the nearest voxels: `mrol_replica_find_nearest` of mrol.h."]
    mrol_replica_find_nearest: NearestQuestion => NearestPlaces;
    #[doc = "Classifies points: `mrol_replica_classify_points` of mrol.h."]
    mrol_replica_classify_points: ClassifyQuestion => ClassifyPlaces;
    #[doc = "Lists frontiers: `mrol_replica_list_frontiers` of mrol.h."]
    mrol_replica_list_frontiers: FrontierQuestion => FrontierPlaces;
    #[doc = "Looks at the map from above: `mrol_replica_project_grid` of mrol.h."]
    mrol_replica_project_grid: GridQuestion => GridPlaces;
}
