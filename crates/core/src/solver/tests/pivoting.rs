//! Lemke's method against enumeration, known optima and known rays.

use super::Random;
use crate::solver::{LcpResult, lemke};
use nalgebra::{DMatrix, DVector};

/// Every solution that a complementary basis gives.
fn enumerate(m: &DMatrix<f64>, q: &DVector<f64>) -> Vec<DVector<f64>> {
    let n = q.len();
    let mut found = Vec::new();
    for set in 0..1usize << n {
        let active: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
        let part = DMatrix::from_fn(active.len(), active.len(), |i, j| m[(active[i], active[j])]);
        let mut z = DVector::zeros(n);
        if !active.is_empty() {
            if part.clone().svd(false, false).singular_values.min() < 1e-7 {
                continue;
            }
            let right = DVector::from_fn(active.len(), |i, _| -q[active[i]]);
            let Some(x) = part.lu().solve(&right) else { continue };
            active.iter().zip(x.iter()).for_each(|(&i, x)| z[i] = *x);
        }
        if z.min() >= -1e-9 && (m * &z + q).min() >= -1e-9 {
            found.push(z);
        }
    }
    found
}

fn row_major(m: &DMatrix<f64>) -> Vec<f64> {
    m.transpose().as_slice().to_vec()
}

fn solution(m: &DMatrix<f64>, q: &DVector<f64>) -> DVector<f64> {
    match lemke(&row_major(m), q.as_slice()) {
        LcpResult::Solution { z, .. } => DVector::from_vec(z),
        other => panic!("{other:?} for M = {m} q = {q}"),
    }
}

/// `max |min(z, w)|`.
fn violation(m: &DMatrix<f64>, q: &DVector<f64>, z: &DVector<f64>) -> f64 {
    let w = m * z + q;
    (0..q.len()).map(|i| z[i].min(w[i]).abs()).fold(0.0, f64::max)
}

fn matrix(random: &mut Random, rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| random.real(-1.0, 1.0))
}

#[test]
fn a_p_matrix_gives_the_one_solution() {
    let mut random = Random(1);
    for _ in 0..300 {
        let n = 1 + random.index(7);
        let (a, b) = (matrix(&mut random, n, n), matrix(&mut random, n, n));
        // Positive definite plus skew: not symmetric, and every principal minor is positive.
        let m = &a * a.transpose() + DMatrix::identity(n, n) * 0.1 + (&b - b.transpose()) * 2.0;
        let q = DVector::from_fn(n, |_, _| random.real(-2.0, 1.0));
        let expected = enumerate(&m, &q);
        let z = solution(&m, &q);
        assert!((z - &expected[0]).amax() < 1e-9);
    }
}

#[test]
fn a_semidefinite_matrix_gives_the_one_w() {
    let mut random = Random(2);
    for _ in 0..300 {
        let n = 2 + random.index(6);
        let rank = 1 + random.index(n - 1);
        let y = matrix(&mut random, rank, n);
        let m = y.transpose() * &y;
        // q in the range of M: a solution exists.
        let q = y.transpose() * DVector::from_fn(rank, |_, _| random.real(-1.0, 1.0));
        let z = solution(&m, &q);
        assert!(violation(&m, &q, &z) < 1e-10);
        let expected = enumerate(&m, &q);
        assert!((&m * (z - &expected[0])).amax() < 1e-8);
    }
}

#[test]
fn a_degenerate_problem_does_not_cycle() {
    let mut random = Random(3);
    let mut solved = 0;
    for _ in 0..400 {
        let n = 2 + random.index(6);
        let y = DMatrix::from_fn(2 + random.index(3), n, |_, _| random.index(3) as f64 - 1.0);
        let m = y.transpose() * &y;
        let q = DVector::from_fn(n, |_, _| random.index(3) as f64 - 1.0);
        let expected = enumerate(&m, &q);
        match lemke(&row_major(&m), q.as_slice()) {
            LcpResult::Solution { z, pivots } => {
                let z = DVector::from_vec(z);
                assert!(violation(&m, &q, &z) < 1e-10);
                assert!(pivots <= 3 * n as u32, "{pivots} pivots of n = {n}");
                assert!((&m * (z - &expected[0])).amax() < 1e-8);
                solved += 1;
            }
            // M is semidefinite: a ray proves that there is no solution.
            LcpResult::Ray { .. } => assert!(expected.is_empty(), "ray, but {expected:?} solves M = {m} q = {q}"),
            other => panic!("{other:?}"),
        }
    }
    assert!((100..400).contains(&solved), "{solved} of 400 have a solution: the test wants both kinds");
}

/// Kostreva's example, on which Lemke's method cycles with a careless choice among ties; `z = (1/3, 1/3, 1/3)`. With the lexicographic
/// rule no dictionary comes twice, and there are at most 2³ complementary ones, each with three that hold `z₀`.
#[test]
fn kostrevas_example_is_left_in_a_few_pivots() {
    let m = [1.0, 2.0, 0.0, 0.0, 1.0, 2.0, 2.0, 0.0, 1.0];
    for q in [[-1.0; 3], [-1.0, -1.0, -0.5], [0.0, -1.0, -1.0]] {
        let LcpResult::Solution { z, pivots } = lemke(&m, &q) else { panic!("no solution for {q:?}") };
        assert!(pivots <= 10, "{pivots} pivots for {q:?}");
        let (m, q) = (DMatrix::from_row_slice(3, 3, &m), DVector::from_row_slice(&q));
        assert!((DVector::from_vec(z) - &enumerate(&m, &q)[0]).amax() < 1e-12);
    }
}

/// Beale's linear program, on which the simplex method cycles without a rule against it; optimum −1/20 at x = (1/25, 0, 1, 0).
#[test]
fn beales_program_ends_at_its_optimum() {
    let a = DMatrix::from_row_slice(3, 4, &[0.25, -60.0, -0.04, 9.0, 0.5, -90.0, -0.02, 3.0, 0.0, 0.0, 1.0, 0.0]);
    let cost = [-0.75, 150.0, -0.02, 6.0];
    let limit = [0.0, 0.0, 1.0];
    // w_x = cost + Aᵀy, w_y = limit − A·x.
    let m = DMatrix::from_fn(7, 7, |i, j| match (i < 4, j < 4) {
        (true, false) => a[(j - 4, i)],
        (false, true) => -a[(i - 4, j)],
        _ => 0.0,
    });
    let q = DVector::from_iterator(7, cost.into_iter().chain(limit));
    let z = solution(&m, &q);
    let value: f64 = (0..4).map(|i| cost[i] * z[i]).sum();
    assert!((value + 0.05).abs() < 1e-12);
    assert!((z[0] - 0.04).abs() < 1e-12 && (z[2] - 1.0).abs() < 1e-12);
}

#[test]
fn a_problem_without_solution_ends_on_a_ray() {
    let problems = [
        (vec![-1.0], vec![-1.0]),
        (vec![0.0], vec![-1.0]),
        (vec![1.0, -1.0, -1.0, 1.0], vec![-1.0, -1.0]),
        (vec![0.0, -1.0, 1.0, -2.0], vec![-1.0, -3.0]),
    ];
    for (m, q) in problems {
        let n = q.len();
        let matrix = DMatrix::from_row_slice(n, n, &m);
        assert!(
            enumerate(&matrix, &DVector::from_vec(q.clone())).is_empty(),
            "the problem has a solution: {m:?} {q:?}"
        );
        assert!(matches!(lemke(&m, &q), LcpResult::Ray { .. }), "{m:?} {q:?}: {:?}", lemke(&m, &q));
    }
}

/// `M` is copositive but not copositive-plus: `w₁ = 2z₂ − 1`, `w₂ = z₁ − 2`, solved by `z = (2, 1/2)`, and yet a ray. What a ray proves
/// depends on `M`.
#[test]
fn a_ray_may_end_a_problem_that_has_a_solution() {
    let (m, q) = (DMatrix::from_row_slice(2, 2, &[0.0, 2.0, 1.0, 0.0]), DVector::from_vec(vec![-1.0, -2.0]));
    assert_eq!(violation(&m, &q, &DVector::from_vec(vec![2.0, 0.5])), 0.0);
    assert!(matches!(lemke(&row_major(&m), q.as_slice()), LcpResult::Ray { .. }));
}

/// Copies of copies: 200 rows of rank 6, every one of them eight times.
#[test]
fn many_equal_rows_are_solved_exactly() {
    let mut random = Random(4);
    for _ in 0..3 {
        let few = matrix(&mut random, 6, 25);
        let y = DMatrix::from_fn(6, 200, |i, j| few[(i, j % 25)]);
        let m = y.transpose() * &y;
        let q = y.transpose() * DVector::from_fn(6, |_, _| random.real(-1.0, 1.0));
        let z = solution(&m, &q);
        assert!(violation(&m, &q, &z) < 1e-10);
    }
}

#[test]
fn units_do_not_matter() {
    let mut random = Random(5);
    for _ in 0..50 {
        let n = 6;
        let a = matrix(&mut random, n, n);
        let s = DMatrix::from_diagonal(&DVector::from_fn(n, |_, _| 10f64.powf(random.real(-4.0, 4.0))));
        let m = &a * a.transpose() + DMatrix::identity(n, n) * 0.1;
        let q = DVector::from_fn(n, |_, _| random.real(-2.0, 1.0));
        let plain = solution(&m, &q);
        let scaled = &s * solution(&(&s * m * &s), &(&s * q));
        assert!((plain - scaled).amax() < 1e-8);
    }
}

#[test]
fn what_is_not_a_number_is_refused() {
    assert_eq!(lemke(&[f64::NAN], &[1.0]), LcpResult::NotFinite);
    assert_eq!(lemke(&[1.0], &[f64::INFINITY]), LcpResult::NotFinite);
    assert_eq!(lemke(&[], &[]), LcpResult::Solution { z: Vec::new(), pivots: 0 });
    assert_eq!(lemke(&[0.0], &[0.0]), LcpResult::Solution { z: vec![0.0], pivots: 0 });
}
