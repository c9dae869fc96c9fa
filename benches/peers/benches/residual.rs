//! Residual over CPU time of every solver on ten contact problems, from zero multipliers.
//!
//! ```text
//! cargo bench --bench residual                                             the table
//! cargo bench --bench residual -- --svg ../../docs/images/residual.svg     also as a picture
//! ```

use tumble_peers::residuals::{Curve, Problem, SOLVERS, curves, draw, problems};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    println!("Last point of each solver: CPU s, residual in m/s.\n");
    println!("| problem | blocks | {} |", SOLVERS.map(|s| s.0).join(" | "));
    println!("|---|---|{}", "---|".repeat(SOLVERS.len()));
    let mut panels = Vec::new();
    for problem in problems() {
        let curves = curves(&problem);
        println!("{}", line(&problem, &curves));
        panels.push((format!("{} ({} blocks)", problem.name, problem.blocks.len()), curves));
    }
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => {}
        ["--svg", path] => std::fs::write(path, draw(&panels)).expect("the picture can be written"),
        _ => panic!("the only option is --svg PATH"),
    }
}

fn line(problem: &Problem, curves: &[Curve; 5]) -> String {
    let cell = |curve: &Curve| match curve.last() {
        Some((time, error)) => format!("{time:.1e}, {error:.1e}"),
        None => "–".into(),
    };
    format!("| {} | {} | {} |", problem.name, problem.blocks.len(), curves.each_ref().map(cell).join(" | "))
}
