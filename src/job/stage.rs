use serde::{Deserialize, Serialize};

use crate::pipeline::{Plan, PlanStage};

/// What is done in a job: to the scans of a registration one by one or together, or to all pictures of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum JobStage {
    /// Each scan is read and looked at by itself.
    Inspect,
    /// Their landmarks are held beside each other, and it is decided who is registered how.
    Plan,
    /// A stage of the plan.
    Engine(PlanStage),
    /// Each result is judged and written.
    Package,
    /// The files of the whole set.
    Set,
    /// A mesh from pictures, the whole of it.
    Invert,
}

impl JobStage {
    /// Those of every registration, before its plan is known.
    pub const FIRST: [Self; 2] = [Self::Inspect, Self::Plan];

    /// All those of a registration with this plan.
    pub fn all_of(plan: &Plan) -> Vec<Self> {
        let engine = plan.stages().into_iter().map(Self::Engine);
        Self::FIRST.into_iter().chain(engine).chain([Self::Package, Self::Set]).collect()
    }

    /// Whether it is one step for all scans.
    pub fn is_shared(self) -> bool {
        match self {
            Self::Inspect | Self::Package => false,
            Self::Plan | Self::Set | Self::Invert => true,
            Self::Engine(stage) => stage.is_shared(),
        }
    }

    /// Its name in states, events and metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inspect => "inspect",
            Self::Plan => "plan",
            Self::Engine(PlanStage::Fit) => "fit",
            Self::Engine(PlanStage::Resample) => "resample",
            Self::Engine(PlanStage::Register) => "register",
            Self::Engine(PlanStage::Lay) => "lay",
            Self::Engine(PlanStage::Mean(_)) => "mean",
            Self::Engine(PlanStage::Round(_)) => "round",
            Self::Package => "package",
            Self::Set => "set",
            Self::Invert => "invert",
        }
    }
}
