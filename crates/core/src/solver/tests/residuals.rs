//! The residual on solutions and non-solutions made by hand.

use super::Bodies;
use super::UP;
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::residual;

/// The residual of one row of 1 kg along one degree of freedom: `w = c + λ`.
fn scalar(set: RowSet, c: f64, lambda: f64) -> f64 {
    let mut rows = Rows::default();
    rows.clear(1);
    rows.push_block(set);
    rows.side(0, 1).expect("first side")[0] = 1.0;
    residual(&rows, &[0], &[c], &[lambda], &[lambda])
}

#[test]
fn scalar_rows_are_judged_by_their_sets() {
    let interval = RowSet::Interval { lo: -1.0, hi: 2.0 };
    let solved = [
        (RowSet::Equality, -3.0, 3.0),
        (RowSet::Equality, 3.0, -3.0),
        (RowSet::HalfLine, -3.0, 3.0),
        (RowSet::HalfLine, 3.0, 0.0),
        (interval, -1.5, 1.5),
        (interval, -5.0, 2.0),
        (interval, 5.0, -1.0),
    ];
    for (set, c, lambda) in solved {
        assert!(scalar(set, c, lambda) < 1e-15, "{set:?} {c} {lambda}");
    }
    // What is wrong, and by how much: penetration left, pull, push while opening, an end not
    // reached, an end passed.
    let wrong = [
        (RowSet::Equality, -3.0, 2.5, 0.5),
        (RowSet::HalfLine, -3.0, 2.5, 0.5),
        (RowSet::HalfLine, 3.0, -0.5, 0.5),
        (RowSet::HalfLine, 3.0, 0.25, 0.25),
        (interval, -5.0, 1.5, 0.5),
        (interval, -5.0, 2.5, 0.5),
    ];
    for (set, c, lambda, by) in wrong {
        assert!((scalar(set, c, lambda) - by).abs() < 1e-15, "{set:?} {c} {lambda}: {}", scalar(set, c, lambda));
    }
}

/// A point contact of 1 kg that cannot turn: `K` is the identity.
fn cone(mu: f64, c: [f64; 3], lambda: [f64; 3]) -> f64 {
    let mut bodies = Bodies::cubes(vec![1.0], 1.0);
    bodies.push(RowSet::Cone { mu }, [None, Some((0, [0.0; 3]))], UP);
    let du = [0.0, 0.0, 0.0, lambda[1], lambda[2], lambda[0]];
    residual(&bodies.rows, &[0], &c, &lambda, &du)
}

#[test]
fn contacts_are_judged_by_coulombs_law() {
    // Open, sticking, sliding (without the dilation of a convex cone: w_n = 0), sliding along a
    // diagonal, without friction.
    let solved = [
        (0.5, [1.0, 3.0, -2.0], [0.0; 3]),
        (0.5, [-2.0, 0.6, 0.8], [2.0, -0.6, -0.8]),
        (0.5, [-2.0, 4.0, 0.0], [2.0, -1.0, 0.0]),
        (0.5, [-2.0, 3.0, 4.0], [2.0, -0.6, -0.8]),
        (0.0, [-2.0, 4.0, 0.0], [2.0, 0.0, 0.0]),
    ];
    for (mu, c, lambda) in solved {
        assert!(cone(mu, c, lambda) < 1e-14, "{mu} {c:?} {lambda:?}: {}", cone(mu, c, lambda));
    }
    // Too weak, sideways, along the sliding, outside the cone, the convex answer that opens, a
    // pull, penetration left.
    let wrong = [
        (0.5, [-2.0, 4.0, 0.0], [2.0, -0.5, 0.0]),
        (0.5, [-2.0, 4.0, 0.0], [2.0, 0.0, 1.0]),
        (0.5, [-2.0, 4.0, 0.0], [2.0, 1.0, 0.0]),
        (0.5, [-2.0, 4.0, 0.0], [2.0, -2.0, 0.0]),
        (0.5, [-2.0, 4.0, 0.0], [3.2, -1.6, 0.0]),
        (0.5, [2.0, 0.0, 0.0], [-0.5, 0.0, 0.0]),
        (0.5, [-2.0, 0.0, 0.0], [1.5, 0.0, 0.0]),
    ];
    for (mu, c, lambda) in wrong {
        assert!(cone(mu, c, lambda) > 0.1, "{mu} {c:?} {lambda:?}: {}", cone(mu, c, lambda));
    }
}

/// A multiplier that is not a number makes the residual no number, also if blocks with a finite one follow.
#[test]
fn what_is_not_a_number_is_no_small_error() {
    let mut rows = Rows::default();
    rows.clear(3);
    for k in 0..3 {
        rows.push_block(RowSet::HalfLine);
        rows.side(k, 1).expect("first side")[0] = 1.0;
    }
    let (c, lambda) = ([-1.0; 3], [1.0, f64::NAN, 0.5]);
    assert!(residual(&rows, &[0, 1, 2], &c, &lambda, &lambda).is_nan());
    assert!((residual(&rows, &[0, 2], &c, &lambda, &lambda) - 0.5).abs() < 1e-15);
}
