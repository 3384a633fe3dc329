//! What one caller may legally ask of a server so often that others could wait for it, and the others.

mod aim;
mod assailants;
mod assault;
mod attacker;
mod honest;
mod keys;
mod kind;
mod loiterer;
mod made;

pub(crate) use aim::Aim;
pub(crate) use assailants::Assailants;
pub(crate) use assault::{Assault, Damage};
pub(crate) use honest::{MappingRobot, Operator, Prober, QuestioningPlanner, Routine};
pub(crate) use keys::{Holder, KeyRing};
pub(crate) use kind::Attack;
