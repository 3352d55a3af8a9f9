//! What every recipe says alike: where the gauge is bonded, and how three fingers stand around an object.

use serde::Deserialize;

use crate::chain::Gauge;
use crate::check::{FieldError, within, wrong};
use crate::grasp::{Grasp, Gripped};
use crate::object::Object;

/// The strain gauge's place.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GaugePart {
    from_mm: f64,
    to_mm: f64,
    distance_mm: f64,
}

/// The gripper and its objects.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GraspPart {
    #[serde(default = "three")]
    fingers: usize,
    palm_radius_mm: f64,
    link_radius_mm: f64,
    friction: f64,
    sphere: SpherePart,
    cylinder: CylinderPart,
}

fn three() -> usize {
    3
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct SpherePart {
    diameter_mm: f64,
    depth_mm: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CylinderPart {
    diameter_mm: f64,
    height_mm: f64,
    depth_mm: f64,
}

impl GaugePart {
    pub(crate) fn check(&self, finger_mm: f64) -> Result<Gauge, FieldError> {
        within("gauge.from_mm", self.from_mm, 0.0, finger_mm)?;
        within("gauge.to_mm", self.to_mm, 0.0, finger_mm)?;
        within("gauge.distance_mm", self.distance_mm, 0.01, 50.0)?;
        if self.to_mm <= self.from_mm {
            let expected = format!("must lie beyond gauge.from_mm, {} mm", self.from_mm);
            return Err(wrong("gauge.to_mm", self.to_mm, expected));
        }
        Ok(Gauge {
            from_m: 1e-3 * self.from_mm,
            to_m: 1e-3 * self.to_mm,
            distance_m: 1e-3 * self.distance_mm,
        })
    }
}

impl GraspPart {
    pub(crate) fn check(&self, finger_mm: f64) -> Result<Grasp, FieldError> {
        within("grasp.fingers", self.fingers as f64, 2.0, 4.0)?;
        let palm = self.palm_radius_mm;
        within("grasp.palm_radius_mm", palm, 1.0, 1000.0)?;
        within("grasp.link_radius_mm", self.link_radius_mm, 0.1, palm)?;
        within("grasp.friction", self.friction, 0.0, 5.0)?;
        // Between open fingers.
        let widest = 2.0 * (palm - self.link_radius_mm);
        let (sphere, cylinder) = (&self.sphere, &self.cylinder);
        within("grasp.sphere.diameter_mm", sphere.diameter_mm, 1.0, widest)?;
        within("grasp.sphere.depth_mm", sphere.depth_mm, 0.1, finger_mm)?;
        within(
            "grasp.cylinder.diameter_mm",
            cylinder.diameter_mm,
            1.0,
            widest,
        )?;
        within("grasp.cylinder.height_mm", cylinder.height_mm, 1.0, 1000.0)?;
        within("grasp.cylinder.depth_mm", cylinder.depth_mm, 0.1, finger_mm)?;
        Ok(Grasp {
            fingers: self.fingers,
            palm_radius_m: 1e-3 * palm,
            link_radius_m: 1e-3 * self.link_radius_mm,
            friction: self.friction,
            sphere: Gripped {
                object: Object::Sphere {
                    radius_m: 0.5e-3 * sphere.diameter_mm,
                },
                depth_m: 1e-3 * sphere.depth_mm,
            },
            cylinder: Gripped {
                object: Object::Cylinder {
                    radius_m: 0.5e-3 * cylinder.diameter_mm,
                    height_m: 1e-3 * cylinder.height_mm,
                },
                depth_m: 1e-3 * cylinder.depth_mm,
            },
        })
    }
}
