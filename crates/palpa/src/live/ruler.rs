//! Where the tool of a recorded tick is, measured by the skin at rest.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector4};
use palpa_mesh::{Surface, SurfaceIndex, Vec3};
use palpa_rt::{DeviceRecord, Felt};
use palpa_scene::{ModelKind, Scene};
use palpa_servo::Pose;

use super::{LiveScene, SpringScene};

/// Least force that has a direction, N.
const LEAST_FORCE: f64 = 1e-9;

/// The skin of a scene at rest, in the frame of the scene, with the pose of the device's frame.
#[derive(Debug)]
pub struct Ruler {
    skin: Surface,
    index: SurfaceIndex,
    normals: Vec<Vec3>,
    scene_from_device: Pose,
}

impl Ruler {
    /// Measures by this skin; `scene_from_device` is the pose of the device's frame in the scene.
    pub fn new(skin: Surface, scene_from_device: Pose) -> Self {
        Self {
            index: SurfaceIndex::build(&skin),
            normals: skin.vertex_normals(),
            skin,
            scene_from_device,
        }
    }

    /// Builds the body of a scene.
    ///
    /// # Errors
    /// When the body cannot be built.
    pub fn of_scene(scene: &Scene) -> anyhow::Result<Self> {
        Ok(match scene.model.kind {
            ModelKind::Tissue => {
                let live = LiveScene::build(scene)?;
                let skin = live.prepared.grown.growth.body.skin.clone();
                Self::new(skin, live.scene_from_device)
            }
            ModelKind::Reference => {
                let springs = SpringScene::build(scene)?;
                Self::new(springs.body().skin.clone(), springs.scene_from_device)
            }
        })
    }

    /// Depth of the tool's tip below the skin at rest, and the nearest place there; `None` without a
    /// reading of the device.
    pub fn measure(&self, device: &DeviceRecord) -> Option<Felt> {
        if !device.is_there {
            return None;
        }
        let tip = self.tip(device);
        let closest = self.index.closest(tip)?;
        let corners = self.skin.triangles.get(closest.triangle as usize)?;
        let normal: Vec3 = (corners.iter().zip(closest.weights))
            .map(|(&v, share)| self.normals[v as usize] * share)
            .sum();
        let normal = normal.try_normalize(1e-9)?;
        Some(Felt {
            depth: normal.dot(&(closest.point - tip)),
            place: closest.point.into(),
        })
    }

    /// Position of the tool's tip, scene's frame, m.
    ///
    /// The coupling is isotropic: it displaces the tool from the device in the direction of the
    /// tissue's force.
    pub fn tip(&self, device: &DeviceRecord) -> Vec3 {
        let push = Vec3::from(device.tissue_force).try_normalize(LEAST_FORCE);
        let tip = Vec3::from(device.position) + push.unwrap_or_default() * device.stretch;
        (self.scene_from_device * Point3::from(tip)).coords
    }

    /// A vector of the device's frame in the frame of the scene.
    pub fn in_scene(&self, vector: [f64; 3]) -> Vec3 {
        self.scene_from_device.rotation * Vec3::from(vector)
    }

    /// Component of the commanded force along the tool's axis, which points out of the tissue, N.
    pub fn along(device: &DeviceRecord) -> f64 {
        let turn = Quaternion::from(Vector4::from(device.orientation));
        let turn = UnitQuaternion::try_new(turn, 0.1).unwrap_or_default();
        (turn * Vec3::z()).dot(&Vec3::from(device.force))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_mesh::generate::limb;

    /// A tube of radius 40 mm along x. The device's z points along the scene's -y.
    fn ruler() -> Ruler {
        let (skin, _) = limb::cylinder(0.16, 0.04, 0.012, 2e-3);
        let turn =
            nalgebra::UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        Ruler::new(
            skin,
            Pose::from_parts(Vec3::new(0.08, 0.0, 0.0).into(), turn),
        )
    }

    #[test]
    fn depth_is_below_the_nearest_place_and_the_coupling_counts() {
        let ruler = ruler();
        let device = |z: f64, stretch: f64| DeviceRecord {
            is_there: true,
            position: [0.0, 0.0, z],
            orientation: [0.0, 0.0, 0.0, 1.0],
            tissue_force: [0.0, 0.0, 2.0],
            stretch,
            force: [0.3, 0.0, 2.0],
            ..DeviceRecord::default()
        };
        for (z, stretch, depth) in [(0.045, 0.0, -5e-3), (0.037, 0.0, 3e-3), (0.036, 1e-3, 3e-3)] {
            let felt = ruler.measure(&device(z, stretch)).unwrap();
            assert!((felt.depth - depth).abs() < 0.1e-3, "{felt:?}");
            // The triangles are flat, so their middles lie a little inside the cylinder.
            let [x, y, z] = felt.place;
            assert!((x - 0.08).abs() < 2e-4 && (y + 0.04).abs() < 2e-4 && z.abs() < 2e-4);
        }
        let lost = DeviceRecord {
            is_there: false,
            ..device(0.037, 0.0)
        };
        assert!(ruler.measure(&lost).is_none());
        assert!((Ruler::along(&device(0.037, 0.0)) - 2.0).abs() < 1e-12);
        let force = ruler.in_scene([0.0, 0.0, 2.0]);
        assert!(
            (force - Vec3::new(0.0, -2.0, 0.0)).norm() < 1e-12,
            "{force}"
        );
    }
}
