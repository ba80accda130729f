//! Event location.

/// Root of `f` in [`a`, `b`], a < b, where `f(a)` = `fa` and `f(b)` = `fb` differ in sign, by the Illinois form of regula falsi
/// (Dowell & Jarratt 1971), to an interval of `width` or until `|f|` <= `small`.
///
/// Returns the end of the final bracket where `f` has the sign of `fb`: the event has occurred there.
pub fn find_root(
    mut a: f64,
    mut fa: f64,
    mut b: f64,
    mut fb: f64,
    width: f64,
    small: f64,
    mut f: impl FnMut(f64) -> f64,
) -> f64 {
    if fb == 0.0 {
        return b;
    }
    // The end that moved last: the Illinois method halves the value at an end that is retained twice in a row.
    let mut moved = 0_i8;
    for _ in 0..80 {
        if (b - a).abs() <= width {
            break;
        }
        let x = b - fb * (b - a) / (fb - fa);
        // Stay clear of the ends, where regula falsi would stall.
        let inset = 1e-3 * (b - a);
        let x = if x.is_finite() { x.clamp(a + inset, b - inset) } else { 0.5 * (a + b) };
        let fx = f(x);
        if (fx > 0.0) == (fb > 0.0) {
            b = x;
            fb = fx;
            if moved == 1 {
                fa *= 0.5;
            }
            moved = 1;
        } else {
            a = x;
            fa = fx;
            if moved == -1 {
                fb *= 0.5;
            }
            moved = -1;
        }
        if fx.abs() <= small && (fx > 0.0) == (fb > 0.0) {
            break;
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_found_and_lies_on_the_far_side_of_the_crossing() {
        let f = |x: f64| x * x * x - 0.3;
        let root = find_root(0.0, f(0.0), 1.0, f(1.0), 1e-14, 0.0, f);
        assert!((root - libm::cbrt(0.3)).abs() < 1e-13);
        assert!(f(root) >= 0.0);
    }
}
