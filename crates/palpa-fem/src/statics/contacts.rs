//! Contact in a solve: the pressures and forces of friction on the skin at the present displacements,
//! how they change, and how far they are from the multipliers.

use std::f64::consts::PI;

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::assembly::Assembler;
use crate::contact::{
    Fineness, Spot, Touch, anchor_at, edge_of, first_touch, kept_gap, nearest_tool, spots_of,
};
use crate::model::Model;
use crate::posed_tool::PosedTool;
use crate::state::{Memory, State};
use crate::system::Hold;

/// A vertex that slips by less than this (m) is held.
const LEAST_SLIP: f64 = 1e-12;
/// Stiffness of a vertex against slip, over `G A/a`, with its area `A` and the radius `a` of the
/// contact: about its share in that of a disc on a half-space, `8 G a/(2 − ν)`. The forces do not
/// depend on it, but the search does: it decides which vertices stick by the friction that their
/// slip would raise. With the stiffness of a vertex whose neighbours are held, which grows with the
/// bulk modulus, nearly incompressible tissue seemed to slip everywhere, then everywhere backwards,
/// and no step sideways converged.
const SHEAR: f64 = 2.0;
/// No slot.
const NONE: u32 = u32::MAX;

/// Violation of the laws of contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ContactResiduals {
    /// Forces by which pressure and friction differ from what the law gives, relative to the force of
    /// contact.
    pub mismatch: f64,
    /// Deepest penetration of a vertex of the skin, m. The law holds on average over triangles: it
    /// falls with their size.
    pub penetration: f64,
}

/// Friction of a vertex, as it is now.
#[derive(Debug, Clone, Copy)]
enum Grip {
    /// The tool has no friction, or nothing presses.
    None,
    /// Held at its anchor. The share of a displacement that moves it away from there.
    Sticks { share: f64 },
    /// Slides: direction of friction, and its stiffness across it, N/m per N/m against slip.
    Slips { along: Vec3, turn: f64, share: f64 },
}

/// A vertex of triangles near a tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slot {
    pub(super) node: usize,
    pub(super) vertex: usize,
    pub(super) tool: u32,
    /// Unit normal of the tool's surface at the vertex, from the tool to the tissue.
    normal: Vec3,
    /// Coefficient of friction that bounds its friction now.
    limit: f64,
    /// Multiplier: the pressure times the area along the normal, friction across it, N.
    multiplier: Vec3,
    /// Force of pressure, N; its size summed over the points; friction, N.
    push: Vec3,
    pub(super) pressing: f64,
    pub(super) friction: Vec3,
    anchor: Vec3,
    grip: Grip,
    /// Area at rest, m², and stiffness against slip, N/m.
    area: f64,
    tangential: f64,
}

impl Slot {
    /// Force of the tool on the vertex, N.
    pub(super) fn force(&self) -> Vec3 {
        self.push + self.friction
    }

    /// Multiplier minus what the law gives, N.
    fn mismatch(&self) -> Vec3 {
        self.multiplier - self.normal * self.pressing - self.friction
    }
}

/// A change of the forces of contact, to first order. `[n_slots]`
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// Of the force on each vertex, N.
    pub(super) forces: Vec<Vec3>,
    /// Of the multiplier that the law gives, N.
    pub(super) laws: Vec<Vec3>,
    pressing: Vec<f64>,
}

/// Where a solve begins: poses of the tools, displacements, and touches.
#[derive(Debug, Default, Clone)]
pub(super) struct Origin {
    pub(super) tools: Vec<PosedTool>,
    pub(super) displacements: Vec<Vec3>,
    pub(super) touches: Vec<Touch>,
    /// Radius of the contact of each tool, m: of a disc with the area that is pressed.
    pub(super) radii: Vec<f64>,
}

impl Origin {
    /// Finds the radii of `n_tools` contacts.
    pub(super) fn measure(&mut self, model: &Model, n_tools: usize) {
        self.radii.clear();
        self.radii.resize(n_tools, 0.0);
        for (touch, area) in self.touches.iter().zip(&model.skin_areas) {
            if let Some(radius) = touch.tool().and_then(|tool| self.radii.get_mut(tool)) {
                *radius += area / PI;
            }
        }
        self.radii
            .iter_mut()
            .for_each(|radius| *radius = radius.sqrt());
    }
}

/// The contacts of all tools at some displacements.
#[derive(Debug, Default)]
pub(super) struct Contacts {
    spots: Vec<Spot>,
    /// Pressure at each point, Pa. `[n_spots]`
    pressures: Vec<f64>,
    pub(super) slots: Vec<Slot>,
    /// Slot of each vertex. `[n_vertices]`
    slot_of: Vec<u32>,
    /// Distance of each vertex from the tools, m. `[n_vertices]`
    distances: Vec<f64>,
}

impl Contacts {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            slot_of: vec![NONE; model.body.n_vertices()],
            distances: vec![f64::INFINITY; model.body.n_vertices()],
            ..Self::default()
        }
    }

    /// Finds the forces of contact at these displacements. The multipliers are those of `touches`.
    pub(super) fn update(
        &mut self,
        model: &Model,
        displacements: &[Vec3],
        tools: &[PosedTool],
        held: &[Hold],
        (touches, origin): (&[Touch], &Origin),
    ) {
        self.find(model, displacements, tools, held, (touches, &origin.radii));
        self.press();
        for slot in &mut self.slots {
            let x = model.body.positions[slot.node] + displacements[slot.node];
            let from = model.body.positions[slot.node] + origin.displacements[slot.node];
            slot.rub(
                &origin.touches[slot.vertex],
                tools,
                &origin.tools,
                [&from, &x],
            );
        }
    }

    /// Finds the points near the tools and the vertices of their triangles.
    fn find(
        &mut self,
        model: &Model,
        displacements: &[Vec3],
        tools: &[PosedTool],
        held: &[Hold],
        (touches, radii): (&[Touch], &[f64]),
    ) {
        for slot in self.slots.drain(..) {
            self.slot_of[slot.vertex] = NONE;
        }
        self.spots.clear();
        if tools.is_empty() {
            return;
        }
        let skin = &model.body.skin;
        let place = |v: u32| {
            let node = model.body.node(v as usize, 0);
            model.body.positions[node] + displacements[node]
        };
        for v in 0..skin.points.len() {
            self.distances[v] =
                nearest_tool(tools, &place(v as u32)).map_or(f64::INFINITY, |n| n.1);
        }
        let fineness = Fineness::of(tools);
        let stiffness = &model.skin_stiffness;
        for &triangle in &skin.triangles {
            let corners = triangle.map(|v| v as usize);
            if corners.iter().all(|&v| held[model.body.node(v, 0)].n == 3) {
                continue;
            }
            let epsilons = corners.map(|v| stiffness.normal[v]);
            // A pressure as in the last step keeps points pressed up to this gap.
            let reach = kept_gap(corners.map(|v| touches[v].pressure), epsilons);
            let nearest = corners.map(|v| self.distances[v]).into_iter();
            let at = triangle.map(place);
            if nearest.fold(f64::INFINITY, f64::min) > reach + edge_of(&at) {
                continue;
            }
            let at_rest = corners.map(|v| skin.points[v]);
            let near = (fineness, reach);
            spots_of(
                triangle,
                &at_rest,
                &at,
                &epsilons,
                tools,
                near,
                &mut self.spots,
            );
        }
        for s in 0..self.spots.len() {
            for v in self.spots[s].vertices {
                if self.slot_of[v as usize] == NONE {
                    self.slot_of[v as usize] = self.slots.len() as u32;
                    let x = place(v);
                    let touch = &touches[v as usize];
                    let slot = Slot::new(model, v as usize, (tools, radii), &x, touch);
                    self.slots.extend(slot);
                }
            }
        }
    }

    fn slot(&self, vertex: u32) -> usize {
        self.slot_of[vertex as usize] as usize
    }

    /// Pressures at the points, and the forces on the vertices.
    fn press(&mut self) {
        self.pressures.clear();
        for slot in &mut self.slots {
            (slot.push, slot.pressing) = (Vec3::zeros(), 0.0);
        }
        for spot in &self.spots {
            let of = |v: u32| {
                let slot = &self.slots[self.slot(v)];
                slot.multiplier.dot(&slot.normal) / slot.area
            };
            let pressure = (spot.mean(of) - spot.stiffness * spot.gap).max(0.0);
            self.pressures.push(pressure);
            if pressure > 0.0 {
                for (&v, share) in spot.vertices.iter().zip(&spot.shares) {
                    let slot = &mut self.slots[self.slot_of[v as usize] as usize];
                    let force = share * spot.area * pressure;
                    slot.push += spot.normal * force;
                    slot.pressing += force;
                }
            }
        }
    }

    /// First-order change of the forces for displacements `moves` of the slots (m) and changes of
    /// the multipliers (N).
    pub(super) fn change(
        &self,
        moves: &dyn Fn(usize) -> Vec3,
        multipliers: &[Vec3],
        out: &mut Changes,
    ) {
        let n = self.slots.len();
        for list in [&mut out.forces, &mut out.laws] {
            list.clear();
            list.resize(n, Vec3::zeros());
        }
        out.pressing.clear();
        out.pressing.resize(n, 0.0);
        for (spot, &pressure) in self.spots.iter().zip(&self.pressures) {
            if pressure <= 0.0 {
                continue;
            }
            let of = |v: u32| {
                let slot = &self.slots[self.slot(v)];
                multipliers[self.slot(v)].dot(&slot.normal) / slot.area
            };
            let mut moved = Vec3::zeros();
            for (&v, share) in spot.vertices.iter().zip(&spot.shares) {
                moved += moves(self.slot(v)) * *share;
            }
            let more = spot.mean(of) - spot.stiffness * spot.normal.dot(&moved);
            let force = (spot.normal * more + spot.curvature * moved * pressure) * spot.area;
            for (&v, share) in spot.vertices.iter().zip(&spot.shares) {
                let i = self.slot(v);
                out.forces[i] += force * *share;
                out.pressing[i] += more * spot.area * share;
            }
        }
        for (i, slot) in self.slots.iter().enumerate() {
            let multiplier = slot.across(&multipliers[i]);
            let moved = slot.across(&moves(i));
            let friction = match slot.grip {
                Grip::None => Vec3::zeros(),
                Grip::Sticks { share } => multiplier - moved * (slot.tangential * share),
                Grip::Slips { along, turn, share } => {
                    let trial = multiplier - moved * (slot.tangential * share);
                    let across = trial - along * along.dot(&trial);
                    along * (slot.limit * out.pressing[i]) + across * turn
                }
            };
            out.forces[i] += friction;
            out.laws[i] = slot.normal * out.pressing[i] + friction;
        }
    }

    /// Stiffness of contact at fixed multipliers, without what friction adds by the pressure: row
    /// vertex, column vertex, and the block.
    pub(super) fn stiffness(&self, mut add: impl FnMut(usize, usize, Mat3)) {
        for (spot, &pressure) in self.spots.iter().zip(&self.pressures) {
            if pressure <= 0.0 {
                continue;
            }
            let normal = spot.normal * spot.normal.transpose() * spot.stiffness;
            let whole = (normal - spot.curvature * pressure) * spot.area;
            for (a, &v) in spot.vertices.iter().enumerate() {
                for (b, &w) in spot.vertices.iter().enumerate() {
                    if v >= w {
                        let block = whole * (spot.shares[a] * spot.shares[b]);
                        add(v as usize, w as usize, block);
                    }
                }
            }
        }
        for slot in &self.slots {
            let plane = Mat3::identity() - slot.normal * slot.normal.transpose();
            let block = match slot.grip {
                Grip::None => continue,
                Grip::Sticks { share } => plane * (slot.tangential * share),
                Grip::Slips { along, turn, share } => {
                    (plane - along * along.transpose()) * (slot.tangential * share * turn)
                }
            };
            add(slot.vertex, slot.vertex, block);
        }
    }

    /// Springs along the normals of the pressed vertices, which hold the body in the factor: vertex
    /// and block, with a stiffness of `share` of the skin's own.
    pub(super) fn springs(&self, model: &Model, share: f64) -> Vec<(usize, Mat3)> {
        let pressed = self.slots.iter().filter(|slot| slot.pressing > 0.0);
        let spring = |slot: &Slot| {
            let own = model.skin_stiffness.normal[slot.vertex] * slot.area;
            let block = slot.normal * slot.normal.transpose() * (share * own);
            (slot.vertex, block)
        };
        pressed.map(spring).collect()
    }

    /// Multipliers minus what the law gives, N. `[n_slots]`
    pub(super) fn mismatches(&self) -> impl Iterator<Item = Vec3> {
        self.slots.iter().map(Slot::mismatch)
    }

    /// The slot of a vertex.
    pub(super) fn slot_at(&self, vertex: usize) -> Option<usize> {
        let slot = self.slot_of[vertex];
        (slot != NONE).then_some(slot as usize)
    }

    /// Ends a solve: keeps the forces of contact, and moves the anchors of vertices that slide to
    /// where they are.
    pub(super) fn end(
        &self,
        model: &Model,
        displacements: &[Vec3],
        tools: &[PosedTool],
        touches: &mut [Touch],
    ) {
        touches.fill(Touch::OPEN);
        for slot in self.slots.iter().filter(|slot| slot.pressing > 0.0) {
            let x = model.body.positions[slot.node] + displacements[slot.node];
            let is_sliding = matches!(slot.grip, Grip::Slips { .. });
            touches[slot.vertex] = Touch {
                tool: slot.tool,
                pressure: slot.pressing / slot.area,
                friction: slot.friction,
                anchor: match slot.grip {
                    Grip::Sticks { .. } => slot.anchor,
                    _ => anchor_at(&tools[slot.tool as usize], &x),
                },
                is_sliding,
            };
        }
    }

    /// Area at rest under pressure (m²) of a tool.
    pub(super) fn area(&self, tool: usize) -> f64 {
        let spots = self.spots.iter().zip(&self.pressures);
        let pressed = spots.filter(|(spot, p)| spot.tool as usize == tool && **p > 0.0);
        pressed.map(|(spot, _)| spot.area).sum()
    }

    /// Largest mean pressure round a vertex under a tool, Pa.
    pub(super) fn largest_pressure(&self, tool: usize) -> f64 {
        let slots = self.slots.iter().filter(|slot| slot.tool as usize == tool);
        slots
            .map(|slot| slot.pressing / slot.area)
            .fold(0.0, f64::max)
    }

    /// Force of the tissue on a tool, N.
    pub(super) fn tool_force(&self, tool: usize) -> Vec3 {
        let spots = self.spots.iter().zip(&self.pressures);
        let own = spots.filter(|(spot, _)| spot.tool as usize == tool);
        let push: Vec3 = own.map(|(spot, p)| spot.normal * (p * spot.area)).sum();
        let slots = self.slots.iter().filter(|slot| slot.tool as usize == tool);
        let friction: Vec3 = slots.map(|slot| slot.friction).sum();
        -(push + friction)
    }

    /// Deepest vertex inside a tool, m.
    pub(super) fn penetration(&self) -> f64 {
        let deepest = self.distances.iter().copied().fold(f64::INFINITY, f64::min);
        (-deepest).max(0.0)
    }
}

impl Slot {
    fn new(
        model: &Model,
        vertex: usize,
        (tools, radii): (&[PosedTool], &[f64]),
        x: &Vec3,
        touch: &Touch,
    ) -> Option<Self> {
        let (nearest, _) = nearest_tool(tools, x)?;
        let tool = touch.tool().filter(|&t| t < tools.len()).unwrap_or(nearest);
        let normal = tools[tool].tool.distance_at(&tools[tool].pose, x).normal;
        let area = model.skin_areas[vertex];
        let friction = touch.friction - normal * normal.dot(&touch.friction);
        Some(Self {
            node: model.body.node(vertex, 0),
            vertex,
            tool: tool as u32,
            normal,
            limit: 0.0,
            multiplier: normal * (touch.pressure * area) + friction,
            push: Vec3::zeros(),
            pressing: 0.0,
            friction: Vec3::zeros(),
            anchor: Vec3::zeros(),
            grip: Grip::None,
            area,
            tangential: SHEAR * model.skin_stiffness.shear[vertex] * area
                / radii[tool].max((area / PI).sqrt()),
        })
    }

    fn across(&self, vector: &Vec3) -> Vec3 {
        vector - self.normal * self.normal.dot(vector)
    }

    /// Finds the friction of the vertex, which goes from one place to the other in this solve.
    fn rub(
        &mut self,
        before: &Touch,
        tools: &[PosedTool],
        tools_before: &[PosedTool],
        [from, to]: [&Vec3; 2],
    ) {
        let posed = &tools[self.tool as usize];
        self.limit = posed.tool.friction_limit(before.is_sliding);
        (self.friction, self.grip) = (Vec3::zeros(), Grip::None);
        if self.limit == 0.0 || self.pressing == 0.0 {
            return;
        }
        let share;
        (self.anchor, share) = if before.tool().is_some() {
            (before.anchor, 1.0)
        } else {
            let start = tools_before.get(self.tool as usize).unwrap_or(posed);
            first_touch(start, posed, from, to)
        };
        let anchor = (posed.pose * nalgebra::Point3::from(self.anchor)).coords;
        let slip = self.across(&(to - anchor));
        let trial = self.across(&self.multiplier) - slip * self.tangential;
        let (size, most) = (trial.norm(), self.limit * self.pressing);
        if size <= most || (size == 0.0 && slip.norm() <= LEAST_SLIP) {
            self.friction = trial;
            self.grip = Grip::Sticks { share };
        } else {
            let along = trial / size;
            self.friction = along * most;
            self.grip = Grip::Slips {
                along,
                turn: most / size,
                share,
            };
        }
    }
}

/// Writes the multipliers of `slots`, moved by a share of their changes (N), into touches.
pub(super) fn move_multipliers(
    slots: &[Slot],
    changes: &[Vec3],
    share: f64,
    touches: &mut [Touch],
) {
    for (slot, change) in slots.iter().zip(changes) {
        let multiplier = slot.multiplier + change * share;
        let touch = &mut touches[slot.vertex];
        touch.tool = slot.tool;
        touch.pressure = multiplier.dot(&slot.normal) / slot.area;
        touch.friction = slot.across(&multiplier);
    }
}

/// Pressures (Pa, `[n_vertices]`) of tools on a body with these displacements (m, `[n_nodes]`) in an
/// equilibrium without memory: what its stresses need. Cost: that of the forces.
pub fn pressures_at(model: &Model, displacements: &[Vec3], tools: &[PosedTool]) -> Vec<f64> {
    /// Share of the largest pressure that is none.
    const NO_PRESSURE: f64 = 1e-3;
    let mut memory = Memory::new(model);
    memory.begin(model, &State::new(model), 0.0);
    let mut assembler = Assembler::new(model, &memory, None);
    assembler.begin(model, &memory);
    let mut forces = vec![Vec3::zeros(); model.n_nodes()];
    let mut pressures = vec![0.0; model.body.n_vertices()];
    if assembler
        .forces(model, &memory, displacements, &mut forces)
        .is_err()
    {
        return pressures;
    }
    for (v, pressure) in pressures.iter_mut().enumerate() {
        let node = model.body.node(v, 0);
        let x = model.body.positions[node] + displacements[node];
        if let Some((k, _)) = nearest_tool(tools, &x) {
            let normal = tools[k].tool.distance_at(&tools[k].pose, &x).normal;
            *pressure = forces[node].dot(&normal).max(0.0) / model.skin_areas[v];
        }
    }
    let largest = pressures.iter().copied().fold(0.0, f64::max);
    for pressure in &mut pressures {
        if *pressure < NO_PRESSURE * largest {
            *pressure = 0.0;
        }
    }
    pressures
}

/// Sets pressures (Pa, `[n_vertices]`) of vertices, with displacements near an equilibrium that has
/// them.
pub fn assume_pressures(model: &Model, state: &mut State, tools: &[PosedTool], pressures: &[f64]) {
    for (vertex, touch) in state.touches.iter_mut().enumerate() {
        let pressure = pressures[vertex];
        if pressure <= 0.0 || pressure.is_nan() {
            continue;
        }
        let node = model.body.node(vertex, 0);
        let x = model.body.positions[node] + state.displacements[node];
        if let Some((k, _)) = nearest_tool(tools, &x) {
            *touch = Touch {
                tool: k as u32,
                pressure,
                anchor: anchor_at(&tools[k], &x),
                ..Touch::OPEN
            };
        }
    }
}
