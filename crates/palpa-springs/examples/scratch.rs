use palpa_mesh::{Vec3, generate::patch};
use palpa_springs::*;
use std::time::Instant;
fn main() {
    let only: Option<usize> = std::env::args().nth(1).map(|s| s.parse().unwrap());
    for (nx, ny, nl) in [(3,3,3),(3,3,4),(4,4,3),(4,4,4),(5,5,5),(7,7,7),(10,10,5),(16,16,4),(32,32,4),(64,64,4)] {
        if only.is_some_and(|o| o != nx*ny*nl) { continue; }
        let depths: Vec<f64> = (0..nl).map(|l| 0.04*l as f64).collect();
        let body = patch::patch(nx, ny, 0.04, &depths, &vec![0; nl-1]);
        let held = body.node(patch::centre_vertex(nx, ny), 0);
        for (solver, by_node) in [(Solver::Sparse, false)] {
            if solver != Solver::Sparse && body.n_nodes() > 520 { continue; }
            if solver == Solver::HistoricalInverse && body.n_nodes() > 150 { continue; }
            let mut params = SpringParams::new([LayerStiffness::Spring { stiffness: 1.0e-3 }]);
            params.solver = solver;
            let t = Instant::now();
            let mut net = Network::from_body(&body, &params).unwrap(); if by_node { net.column = (0..body.n_nodes() as u32).collect(); }
            let model = SpringModel::from_network(net, &Constraints::hold(&body, [held]), solver).unwrap();
            let build = t.elapsed().as_secs_f64();
            let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
            let mut best = f64::INFINITY;
            let t0 = Instant::now();
            let mut i = 0;
            let mut times = vec![];
            while t0.elapsed().as_secs_f64() < 0.5 || i < 4 {
                let t = Instant::now();
                let sign = if (i/20) % 2 == 0 { -1.0 } else { 1.0 };
                let r = step(&model, &mut state, &mut ws, Vec3::new(0.0, 0.0, sign*0.001), &StepParams::default());
                assert_eq!(r.outcome, Outcome::Converged);
                let dt = t.elapsed().as_secs_f64();
                best = f64::min(best, dt); times.push(dt); i += 1;
            }
            times.sort_by(f64::total_cmp);
            println!("{:5} nodes {:5} dofs {:?}: build {:.2} ms, median {:.0}/s best {:.0}/s", body.n_nodes(), model.n_dofs(), model.solver(), build*1e3, 1.0/times[times.len()/2], 1.0/best);
        }
    }
}
