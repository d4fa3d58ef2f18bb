use palpa_mesh::{Vec3, generate::patch};
use palpa_springs::*;
fn main() {
    let soft = LayerStiffness::Spring { stiffness: 1.0e-3 };
    let hard = LayerStiffness::Spring { stiffness: 90.0e-3 };
    for (name, h) in [("uniform",[soft,soft,soft]),("middle",[soft,hard,soft]),("bottom",[soft,soft,hard])] {
        let body = patch::patch(4, 4, 0.04, &[0.0,0.04,0.08,0.12], &[0,1,2]);
        let held = body.node(patch::centre_vertex(4, 4), 0);
        let model = SpringModel::build(&body, &SpringParams::new(h), &Constraints::hold(&body,[held])).unwrap();
        for dir in [-1.0, 1.0] {
        for total in [0.005, 0.01, 0.02,0.04,0.06, 0.08,0.12,0.16] {
          for gain in [0.5, 1.0, 1.5] {
            let mut out = format!("{name} dir {dir} total {total} gain {gain}:");
            for (method, steps) in [(Method::FiniteElements, 1), (Method::FiniteElements,10), (Method::Euler(EulerParams{gain}), 1), (Method::Euler(EulerParams{gain}), 10),(Method::Euler(EulerParams{gain}), 100)] {
            let (mut st, mut ws) = (SpringState::new(&model), Workspace::new(&model));
            let mut last = None;
            for i in 0..steps+2000 {
                let d = if i < steps {dir*total/steps as f64} else {0.0};
                let r = step(&model, &mut st, &mut ws, Vec3::new(0.0,0.0,d), &StepParams{method, ..StepParams::default()});
                last = Some((r.outcome, r.force.z*1e5, i));
                if matches!(r.outcome, Outcome::Diverged{..}) {break;}
            }
            let (o,f,i)=last.unwrap();
            out += &format!(" | {} {:.2} @{}", match o {Outcome::Converged=>"ok".into(), o=>format!("{o:?}")}, f, i);
            }
            println!("{out}");
          }
          let c = steps_to_cross(&model, Vec3::new(0.0,0.0,dir*total), &StepParams::euler(), 0.9, 20000);
          println!("   cross {c:?} FE {:?}", steps_to_cross(&model, Vec3::new(0.0,0.0,dir*total), &StepParams{corrections:Corrections::OFF,..StepParams::default()}, 0.9, 50));
        } }
    }
}
