use hyd_report::*;
use std::sync::Arc;
fn read(p: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let t = std::fs::read_to_string(p).unwrap();
    let mut l = t.lines();
    let h: Vec<String> = l.next().unwrap().split(',').map(String::from).collect();
    let mut c = vec![Vec::new(); h.len()];
    for r in l { for (k, f) in r.split(',').enumerate() { c[k].push(f.parse().unwrap_or(f64::NAN)); } }
    (h, c)
}
fn main() {
    let unit = |n: &str| match n.rsplit('_').next().unwrap() { "Pa" => "Pa", "m" => "m", "V" => "V", "A" => "A", _ => "" }.to_string();
    for (out, files) in [("one", vec!["B01_exp1"]), ("two", vec!["B01_exp1", "B02_exp1"])] {
        let mut cs = vec![];
        for (r, f) in files.iter().enumerate() {
            let (h, c) = read(&format!("/work/shared/bench/{f}.csv"));
            let times: Arc<[f64]> = c[0].clone().into();
            for k in 1..h.len() { cs.push((unit(&h[k]), Curve { name: h[k].clone(), run: r, times: times.clone(), values: c[k].clone() })); }
        }
        let f = Figure { title: Some("Single-acting drive".into()), ..Figure::by_unit(files.iter().map(|s| s.to_string()).collect(), cs.clone()) };
        let d = f.draw();
        std::fs::write(format!("/tmp/hyd/cli/{out}.svg"), d.svg()).unwrap();
        std::fs::write(format!("/tmp/hyd/cli/{out}.png"), d.png(2.0).unwrap()).unwrap();
        let f = Figure::by_unit(files.iter().map(|s| s.to_string()).collect(), cs.into_iter().filter(|c| c.1.name.starts_with("x_") || c.1.name.starts_with("pR")));
        std::fs::write(format!("/tmp/hyd/cli/{out}_few.png"), f.draw().png(2.0).unwrap()).unwrap();
    }
    let t: Vec<f64> = (0..2000).map(|k| k as f64 * 5e-4).collect();
    let times: Arc<[f64]> = t.clone().into();
    let cs = (0..12).map(|i| ("V".to_string(), Curve { name: format!("ladder.cell[{}].v", i + 1), run: 0, times: times.clone(), values: t.iter().map(|t| (t * (i + 1) as f64).sin() / (i + 1) as f64).collect() }));
    std::fs::write("/tmp/hyd/cli/many.png", Figure::by_unit(vec![], cs).draw().png(2.0).unwrap()).unwrap();
}
