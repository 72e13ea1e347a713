//! The least value of a function of few variables: the simplex method of Nelder and Mead (1965).

/// Returns where `function` is least near `start`, and its value there. Infinite values are walls.
///
/// It starts again at each minimum that it finds, until that gains less than `precision`: a simplex can collapse beside the
/// minimum.
pub(crate) fn least<const N: usize>(
    function: impl Fn([f64; N]) -> f64,
    start: [f64; N],
    step: f64,
    precision: f64,
) -> ([f64; N], f64) {
    let mut best = (start, function(start));
    for round in 0..6 {
        let found = descend(&function, best, step / f64::from(1 << round), precision);
        let gain = best.1 - found.1;
        best = found;
        if round > 0 && (gain <= precision || gain.is_nan()) {
            break;
        }
    }
    best
}

fn descend<const N: usize>(
    function: &impl Fn([f64; N]) -> f64,
    start: ([f64; N], f64),
    step: f64,
    precision: f64,
) -> ([f64; N], f64) {
    let mut simplex = vec![start];
    for axis in 0..N {
        let mut point = start.0;
        point[axis] += step;
        let mut value = function(point);
        if value.is_infinite() {
            point[axis] -= 2.0 * step;
            value = function(point);
        }
        simplex.push((point, value));
    }
    for _ in 0..400 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (simplex[0], simplex[N]);
        if worst.1 - best.1 <= precision {
            break;
        }
        let mut centre = [0.0; N];
        for (point, _) in &simplex[..N] {
            for axis in 0..N {
                centre[axis] += point[axis] / N as f64;
            }
        }
        // On the line from the worst point through the centre of the others.
        let at = |factor: f64| {
            let mut point = centre;
            for axis in 0..N {
                point[axis] += factor * (worst.0[axis] - centre[axis]);
            }
            (point, function(point))
        };
        let reflected = at(-1.0);
        let replacement = if reflected.1 < best.1 {
            let expanded = at(-2.0);
            if expanded.1 < reflected.1 { expanded } else { reflected }
        } else if reflected.1 < simplex[N - 1].1 {
            reflected
        } else {
            let contracted = if reflected.1 < worst.1 { at(-0.5) } else { at(0.5) };
            if contracted.1 < worst.1.min(reflected.1) {
                contracted
            } else {
                for (point, value) in &mut simplex[1..] {
                    for (coordinate, of_best) in point.iter_mut().zip(best.0) {
                        *coordinate = f64::midpoint(*coordinate, of_best);
                    }
                    *value = function(*point);
                }
                continue;
            }
        };
        simplex[N] = replacement;
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, and a minimum at a wall.
    #[test]
    fn minima_of_known_functions_are_found() {
        let valley = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let (found, value) = least(valley, [-1.2, 1.0], 0.5, 1e-12);
        assert!(value < 1e-9 && (found[0] - 1.0).abs() < 1e-4, "{found:?}");
        let wall = |[x]: [f64; 1]| if x < 2.0 { f64::INFINITY } else { x };
        assert!((least(wall, [5.0], 1.0, 1e-9).1 - 2.0).abs() < 1e-6);
    }
}
