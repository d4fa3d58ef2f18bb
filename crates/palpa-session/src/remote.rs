//! The server's end of a session: sends orders to the session's thread, and assembles files.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use palpa::live::Ruler;
use palpa::map::PalpationMap;
use palpa_fem::Model;
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_rt::{LEAD, LateTick, Table};
use palpa_scene::{LengthUnit, Scene};
use palpa_viewer::control::{Request, Uploaded};
use palpa_viewer::{Answer, Clients, Host, HostFile};

use crate::own::{Folder, Shelf, packed};
use crate::palpation;
use crate::replay::curve_of;
use crate::spectrum::spectrum;
use crate::world::World;
use palpa_plot::vtu::Grid;

/// Longest time that a file waits for the session's thread.
const PATIENCE: Duration = Duration::from_secs(5);

/// A message to the session's thread.
pub(super) enum Order {
    Request(Request, Answer),
    Clients(Clients),
    File(HostFile, SyncSender<Option<Material>>),
    /// A scene was built, or building failed.
    Built(Box<anyhow::Result<World>>),
    Stop,
}

/// The data of a file, before it is written.
pub(super) enum Material {
    Scene(String),
    /// The scene with its files, and the folder that keeps them until they are packed.
    Archive(Box<Scene>, Option<Arc<Folder>>),
    Tissue(Arc<Model>, Vec<Vec3>),
    Springs(Box<LayeredBody>, Vec<Vec3>),
    /// The log of the recording, and the skin of its body.
    Log(PathBuf, Arc<Ruler>),
    /// The palpation map, and the skin.
    Map(Box<PalpationMap>, Surface),
    /// The results of a game.
    Game(String),
    /// The last ticks.
    Ticks(Vec<LateTick>),
}

/// The server's end of a session.
#[derive(Debug)]
pub struct Remote {
    pub(super) orders: Sender<Order>,
    pub(super) problem: Arc<Mutex<Option<String>>>,
    pub(super) curve: Mutex<Option<Curve>>,
    pub(super) shelf: Shelf,
}

/// The curve of a recording as JSON. It is kept, because each page asks for it and a long log takes
/// seconds to read.
#[derive(Debug)]
pub(super) struct Curve {
    log: PathBuf,
    json: Vec<u8>,
}

impl Host for Remote {
    fn request(&self, request: Request, answer: Answer) {
        // If the session has ended, nobody answers; the server is then ending too.
        let _ = self.orders.send(Order::Request(request, answer));
    }

    fn clients(&self, clients: Clients) {
        let _ = self.orders.send(Order::Clients(clients));
    }

    fn file(&self, file: HostFile) -> Result<Option<Vec<u8>>, String> {
        let (reply, material) = sync_channel(1);
        let _ = self.orders.send(Order::File(file, reply));
        let material = material
            .recv_timeout(PATIENCE)
            .map_err(|_| "the session does not answer; try again".to_owned())?;
        let Some(material) = material else {
            return Ok(None);
        };
        self.written(file, material)
            .map_err(|e| palpa::one_paragraph(&e))
    }

    fn upload(&self, name: &str, bytes: Vec<u8>) -> Result<Uploaded, String> {
        let taken = self.shelf.take(name, &bytes);
        taken.map_err(|error| palpa::one_paragraph(&error))
    }

    fn check_uploaded(&self, id: u32, unit: LengthUnit) -> Option<Uploaded> {
        self.shelf.check(id, unit)
    }

    fn uploaded_mesh(&self, id: u32) -> Option<Vec<u8>> {
        Some(self.shelf.mesh(id)?.encode())
    }

    fn problem(&self) -> Option<String> {
        let problem = self.problem.lock();
        problem.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Remote {
    fn written(&self, file: HostFile, material: Material) -> anyhow::Result<Option<Vec<u8>>> {
        Ok(Some(match (material, file) {
            (Material::Log(log, ruler), HostFile::RecordingCurve) => self.curve(log, &ruler)?,
            (Material::Ticks(ticks), _) => match spectrum(&ticks) {
                Some(spectrum) => serde_json::to_vec(&spectrum)?,
                None => return Ok(None),
            },
            (Material::Log(log, ruler), HostFile::RecordingCsv) => csv(&log, &ruler)?,
            (Material::Log(log, _), _) => std::fs::read(log)?,
            (Material::Map(map, _), HostFile::MapCsv) => palpation::table(&map).into_bytes(),
            (Material::Map(map, skin), _) => palpation::grid(&map, &skin)?,
            (Material::Scene(text) | Material::Game(text), _) => text.into_bytes(),
            (Material::Archive(scene, _files), _) => packed(&scene)?,
            (Material::Tissue(model, displacements), _) => vtu(model.body(), &displacements)?,
            (Material::Springs(body, displacements), _) => vtu(&body, &displacements)?,
        }))
    }

    /// The curve of a recording. Others who ask meanwhile wait for it.
    fn curve(&self, log: PathBuf, ruler: &Ruler) -> anyhow::Result<Vec<u8>> {
        let mut kept = self.curve.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(curve) = kept.as_ref().filter(|curve| curve.log == log) {
            return Ok(curve.json.clone());
        }
        let curve = curve_of(&log, ruler).context("the course of the recording")?;
        let json = serde_json::to_vec(&curve)?;
        *kept = Some(Curve {
            log,
            json: json.clone(),
        });
        Ok(json)
    }
}

/// The table of the ticks of a log.
fn csv(log: &Path, ruler: &Ruler) -> anyhow::Result<Vec<u8>> {
    let folder = tempfile::tempdir()?;
    palpa_rt::export(log, folder.path(), Table::Csv, |device| {
        ruler.measure(device)
    })?;
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name));
    Ok(joined(&read("ticks.csv")?, &read("device0.csv")?))
}

/// Joins two CSV tables with a row per tick. First come the columns [`LEAD`] of the device, then those of
/// the tick, then the device's others. The device's number of the tick is left out. Its columns whose
/// names the first table has too get the prefix `device_`.
fn joined(ticks: &str, device: &str) -> Vec<u8> {
    let mut out = String::with_capacity(ticks.len() + device.len());
    for (row, (a, b)) in ticks.lines().zip(device.lines()).enumerate() {
        for cell in b.split(',').take(LEAD.len()) {
            out.push_str(cell);
            out.push(',');
        }
        out.push_str(a);
        for cell in b.split(',').skip(LEAD.len() + 1) {
            let is_twice = row == 0 && a.split(',').any(|name| name == cell);
            out.push_str(if is_twice { ",device_" } else { "," });
            out.push_str(cell);
        }
        out.push('\n');
    }
    out.into_bytes()
}

fn vtu(body: &LayeredBody, displacements: &[Vec3]) -> anyhow::Result<Vec<u8>> {
    let at: Vec<Vec3> = (body.positions.iter().zip(displacements))
        .map(|(x, u)| x + u)
        .collect();
    let mut out = Vec::new();
    Grid::of_body(body, &at)
        .with_point_vectors("displacement", displacements)
        .write(&mut out)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::{LEAD, joined};

    #[test]
    fn tables_are_joined_with_each_name_once() {
        let lead = LEAD.join(",");
        let table = joined(
            "tick,now,faults\n1,0.5,0\n",
            &format!("{lead},tick,force_x,faults\n0.5,3,2.5,,,,1,2.5,1\n"),
        );
        let wanted =
            format!("{lead},tick,now,faults,force_x,device_faults\n0.5,3,2.5,,,,1,0.5,0,2.5,1\n");
        assert_eq!(String::from_utf8(table).unwrap(), wanted);
    }
}
