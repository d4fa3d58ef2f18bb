use palpa_mesh::*;
use palpa_mesh::growth::Thickness;
fn obj(p: &str) -> Surface {
    let mut s = Surface::default();
    for l in std::fs::read_to_string(p).unwrap().lines() {
        let w: Vec<&str> = l.split_whitespace().collect();
        match w.first() { Some(&"v") => s.points.push(Vec3::new(w[1].parse().unwrap(), w[2].parse().unwrap(), w[3].parse().unwrap())),
          Some(&"f") => s.triangles.push([1,2,3].map(|i| w[i].split('/').next().unwrap().parse::<u32>().unwrap()-1)), _ => {} }
    }
    s
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let skin = obj(&a[1]);
    let bones: Vec<Surface> = a[3..].iter().map(|p| obj(p)).collect();
    let l = |n: &str, t: Option<f64>, k| LayerSpec { name: n.into(), thickness: t.map(Thickness::Constant), n_levels: k, min_thickness: 2e-4 };
    let layers = vec![l("skin", Some(1.5e-3), 1), l("fat", Some(4e-3), 1), l("muscle", a[2].parse::<f64>().ok(), 4)];
    let t0 = std::time::Instant::now();
    match grow(&skin, &bones, &GrowthParams { layers, cut_out: None }) {
        Ok(g) => {
            println!("{:#?}\n{:?}", g.report, t0.elapsed());
            let b = &g.body;
            let mut o = String::from("# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n");
            o += &format!("POINTS {} double\n", b.n_nodes());
            for p in &b.positions { o += &format!("{} {} {}\n", p.x, p.y, p.z); }
            o += &format!("CELLS {} {}\n", b.n_prisms(), 7 * b.n_prisms());
            for t in 0..b.skin.triangles.len() { for i in 0..b.n_levels - 1 { let p = b.prism(t, i); o += &format!("6 {} {} {} {} {} {}\n", p[0], p[1], p[2], p[3], p[4], p[5]); } }
            o += &format!("CELL_TYPES {}\n", b.n_prisms()); for _ in 0..b.n_prisms() { o += "13\n"; }
            o += &format!("CELL_DATA {}\nSCALARS layer double 1\nLOOKUP_TABLE default\n", b.n_prisms());
            for _ in 0..b.skin.triangles.len() { for i in 0..b.n_levels - 1 { o += &format!("{}\n", b.interval_layer[i]); } }
            o += "SCALARS sj double 1\nLOOKUP_TABLE default\n"; for q in &g.scaled_jacobian { o += &format!("{q}\n"); }
            std::fs::write("/tmp/probe.vtk", o).unwrap();
        }
        Err(e) => println!("ERR {e}\n{:?}", t0.elapsed()),
    }
}
