//! A study of known truth and known orders, for the tests of the harness alone: rules of quadrature.

use super::case::{Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use super::plot::{Cell, CellKind, Map};
use super::row::Row;

/// ∫₀¹ eˣ dx = e − 1 by the left rule (order 1), the midpoint rule (order 2) and Simpson's rule (order 4).
pub(crate) struct Quadrature;

const EXPECTATIONS: &str = r#"
study = "quadrature"
[[order]]
rows = { case = "exponential", method = "left", metric = "absolute error" }
order = 1
tolerance = 0.05
source = "Euler-Maclaurin: h/2 (f(1) - f(0))"
[[order]]
rows = { case = "exponential", method = "midpoint", metric = "absolute error" }
order = 2
tolerance = 0.05
source = "Euler-Maclaurin: h²/24 (f'(1) - f'(0))"
[[order]]
rows = { case = "exponential", method = "simpson", metric = "absolute error" }
order = 4
tolerance = 0.1
source = "Euler-Maclaurin: h⁴/2880 (f'''(1) - f'''(0))"
[[bound]]
rows = { method = "midpoint", metric = "absolute error", resolution = 64 }
at_most = 2e-5
at_least = 1.7e-5
source = "(e - 1)/(24 · 64²) = 1.748e-5"
"#;

fn rule(method: &str, n: usize) -> f64 {
    let h = 1.0 / n as f64;
    let at = |x: f64| x.exp();
    (0..n)
        .map(|k| {
            let x = k as f64 * h;
            h * match method {
                "left" => at(x),
                "midpoint" => at(x + 0.5 * h),
                _ => (at(x) + 4.0 * at(x + 0.5 * h) + at(x + h)) / 6.0,
            }
        })
        .sum()
}

impl Study for Quadrature {
    fn name(&self) -> &'static str {
        "quadrature"
    }

    fn title(&self) -> &'static str {
        "Rules of quadrature"
    }

    fn summary(&self) -> &'static str {
        "three rules against an exact integral"
    }

    fn about(&self) -> &'static str {
        "Three rules of known order against an exact integral.\n\nEach n is one sweep point."
    }

    fn expectations(&self) -> &'static str {
        EXPECTATIONS
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let largest = if quick { 8 } else { 12 };
        let runs = ["left", "midpoint", "simpson"].into_iter().flat_map(|method| {
            (3..=largest).map(move |k| {
                let n = 1_usize << k;
                Run::new(method, n as f64, move |probe: &mut Probe| {
                    let integral = probe.time(|| (0..100).map(|_| rule(method, n)).sum::<f64>() / 100.0);
                    let truth = 1_f64.exp_m1();
                    Ok(Outcome::of("absolute error", (integral - truth).abs()).drift(0.0))
                })
                .with("threads", 1)
            })
        });
        Ok(vec![Case {
            name: "exponential",
            truth: "The integral of the exponential over the unit interval is e − 1.".to_owned(),
            resolution: "intervals",
            curves: Curves::standard("absolute error"),
            runs: runs.collect(),
        }])
    }

    fn maps(&self, rows: &[Row]) -> Vec<Map> {
        let cells = rows.iter().take(4).map(|row| Cell {
            kind: if row.ok { CellKind::Stable } else { CellKind::Wrong },
            text: row.resolution.to_string(),
        });
        vec![Map {
            name: "map".to_owned(),
            title: "A map".to_owned(),
            columns_label: "n".to_owned(),
            columns: ["a", "b", "c", "d"].map(str::to_owned).to_vec(),
            rows: vec![("left".to_owned(), cells.collect())],
        }]
    }
}
