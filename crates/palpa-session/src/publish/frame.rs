//! Snapshots of engine and body, in the units and types of the wire.

use nalgebra::Point3;
use palpa::live::Ruler;
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_rt::TickEntry;
use palpa_servo::Pose;
use palpa_viewer::control::Field;
use palpa_viewer::wire::{FrameSnapshot, MeshSnapshot};

use super::fields::NodeField;

/// Smallest unit of displacements, m: smaller ones are not visible.
const LEAST_UNIT: f64 = 1e-8;

/// The mesh of a body at rest. `stiffness` has a value for each prism, Pa. `[n_prisms]`
pub(super) fn mesh(
    number: u32,
    body: &LayeredBody,
    stiffness: Vec<f32>,
    bones: &[Surface],
) -> MeshSnapshot {
    let mut bone_positions = Vec::new();
    let mut bone_triangles = Vec::new();
    for bone in bones {
        let first = (bone_positions.len() / 3) as u32;
        bone_positions.extend(flat(&bone.points));
        bone_triangles.extend(bone.triangles.iter().flatten().map(|v| v + first));
    }
    MeshSnapshot {
        mesh: number,
        n_levels: body.n_levels as u32,
        positions: flat(&body.positions).collect(),
        triangles: body.skin.triangles.iter().flatten().copied().collect(),
        interval_layer: body.interval_layer.iter().map(|&l| l as u8).collect(),
        stiffness,
        bone_positions,
        bone_triangles,
    }
}

fn flat(points: &[Vec3]) -> impl Iterator<Item = f32> + '_ {
    points
        .iter()
        .flat_map(|p| [p.x, p.y, p.z])
        .map(|x| x as f32)
}

/// Puts displacements (m) into a frame, in the finest unit that holds the largest.
pub(super) fn put_displacements(frame: &mut FrameSnapshot, displacements: &[Vec3]) {
    let largest = displacements.iter().map(Vec3::amax).fold(0.0, f64::max);
    let unit = (largest / f64::from(i16::MAX)).max(LEAST_UNIT);
    frame.displacement_unit = unit;
    frame.displacements.clear();
    let components = displacements.iter().flat_map(|u| [u.x, u.y, u.z]);
    frame
        .displacements
        .extend(components.map(|x| (x / unit).round() as i16));
}

/// Puts the vertices in contact into a frame, each with the pressure on it, Pa.
pub(super) fn put_contacts(frame: &mut FrameSnapshot, contacts: &[(u32, f32)]) {
    frame.contacts.clear();
    frame.contact_pressures.clear();
    frame.contacts.extend(contacts.iter().map(|(v, _)| v));
    frame
        .contact_pressures
        .extend(contacts.iter().map(|(_, pressure)| pressure));
}

/// Puts a tick of the loop into a frame. `over` is the place of the skin (point, outward normal)
/// from which depth is measured.
pub(super) fn put_tick(
    frame: &mut FrameSnapshot,
    entry: &TickEntry,
    scene_from_device: &Pose,
    ruler: &Ruler,
    over: &(Vec3, Vec3),
) {
    let (tick, device) = (&entry.tick, &entry.devices[0]);
    let turn = nalgebra::UnitQuaternion::try_new(
        nalgebra::Quaternion::from(nalgebra::Vector4::from(device.orientation)),
        0.1,
    );
    let tip = ruler.tip(device);
    frame.tick = tick.tick as f64;
    frame.time = tick.now;
    frame.device = (scene_from_device * Point3::from(device.position))
        .coords
        .into();
    frame.tool = tip.into();
    frame.orientation = (scene_from_device.rotation * turn.unwrap_or_default())
        .coords
        .into();
    frame.force = ruler.in_scene(device.force).into();
    frame.tissue_force = ruler.in_scene(device.tissue_force).into();
    frame.place = ruler
        .measure(device)
        .map_or(over.0.into(), |felt| felt.place);
    frame.depth = over.1.dot(&(over.0 - tip));
    frame.gain = tick.gain;
    frame.n_active = tick.n_active;
    frame.faults = tick.faults;
    frame.limits = tick.limits;
}

/// Puts a field over the nodes into a frame.
pub(super) fn put_field(frame: &mut FrameSnapshot, field: Option<&NodeField>) {
    let Some(field) = field else {
        frame.field = 0;
        frame.field_values.clear();
        return;
    };
    frame.field = match field.field {
        Field::None => 0,
        Field::VonMises => 1,
        Field::Pressure => 2,
        Field::Stretch => 3,
    };
    let (least, most) = field
        .values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| {
            (a.min(x), b.max(x))
        });
    let span = (most - least)
        .max(1e-12 * most.abs())
        .max(f64::MIN_POSITIVE);
    frame.field_min = least;
    frame.field_max = least + span;
    frame.field_values.clear();
    frame.field_values.extend(
        field
            .values
            .iter()
            .map(|x| ((x - least) / span * f64::from(u16::MAX)).round() as u16),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displacements_are_sent_to_a_part_in_thirty_thousand() {
        let all = [Vec3::new(0.0, -8e-3, 1e-3), Vec3::new(2e-6, 0.0, 5e-4)];
        let mut frame = FrameSnapshot::default();
        put_displacements(&mut frame, &all);
        for (u, sent) in all.iter().zip(frame.displacements.chunks(3)) {
            for c in 0..3 {
                let back = f64::from(sent[c]) * frame.displacement_unit;
                assert!((back - u[c]).abs() <= 0.5 * 8e-3 / 32767.0);
            }
        }
        put_displacements(&mut frame, &[Vec3::zeros()]);
        assert_eq!(frame.displacements, [0; 3]);
    }

    #[test]
    fn a_field_keeps_its_ends() {
        let field = NodeField {
            mesh: 1,
            field: Field::Pressure,
            values: vec![-300.0, 0.0, 1200.0],
        };
        let mut frame = FrameSnapshot::default();
        put_field(&mut frame, Some(&field));
        assert_eq!(
            (frame.field, frame.field_min, frame.field_max),
            (2, -300.0, 1200.0)
        );
        assert_eq!(frame.field_values, [0, 13107, 65535]);
        put_field(&mut frame, None);
        assert!(frame.field_values.is_empty());
    }
}
