//! Decades of numbers, and powers of ten.
//!
//! Both are read off the decimal digits, which are the same on every machine, while a logarithm beside a power of ten is a matter of its
//! last digit.

/// The integer `n` with `10^n <= x < 10^(n+1)`; 0 for what is not positive or not finite.
pub(crate) fn decade(x: f64) -> i32 {
    let digits = if x > 0.0 { format!("{x:e}") } else { String::new() };
    digits.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// The number nearest to `10^exponent`.
pub(crate) fn power_of_ten(exponent: i32) -> f64 {
    // Digits with an exponent are a number always.
    format!("1e{exponent}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::{decade, power_of_ten};

    #[test]
    fn decades_begin_at_powers_of_ten() {
        for exponent in -320..=308 {
            let power = power_of_ten(exponent);
            assert_eq!(decade(power), exponent);
            assert_eq!(decade(power.next_down()), exponent - 1);
        }
        assert_eq!(
            (decade(5e-324), decade(f64::MAX), power_of_ten(-3), power_of_ten(400)),
            (-324, 308, 1e-3, f64::INFINITY)
        );
    }
}
