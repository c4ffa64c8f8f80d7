//! Descriptions of both versions, and colours of Jacobians.

#![allow(clippy::unwrap_used)]

use hyd_system::Pattern;

use crate::colours::Colours;
use crate::description::{Causality, Changes, Description, Initial, Kind, Number, Version};

const TWO: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="A" guid="g" numberOfEventIndicators="2">
  <ModelExchange modelIdentifier="A" completedIntegratorStepNotNeeded="true"/>
  <TypeDefinitions>
    <SimpleType name="Length"><Real unit="m" min="0"/></SimpleType>
    <SimpleType name="Gear"><Enumeration><Item name="slow" value="1"/><Item name="fast" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <DefaultExperiment stopTime="3"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="7"><Real declaredType="Length" start="1.5"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="8"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="g" valueReference="7" causality="parameter" variability="fixed"><Enumeration declaredType="Gear" start="2"/></ScalarVariable>
    <ScalarVariable name="b" valueReference="1" causality="input"><Boolean start="true"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Derivatives><Unknown index="2" dependencies="1 4"/></Derivatives></ModelStructure>
</fmiModelDescription>"#;

#[test]
fn a_description_of_version_two() {
    let read = Description::read(TWO.as_bytes()).unwrap();
    assert_eq!((read.version, read.indicators, read.experiment.stop), (Version::Two, 2, Some(3.0)));
    let exchange = read.exchange.as_ref().unwrap();
    assert!(!exchange.needs_completed_steps && !exchange.directional && read.stepping.is_none());
    let [x, rate, g, b] = read.variables.as_slice() else { panic!("{:?}", read.variables) };
    assert_eq!((&*x.unit, x.min, &x.start, x.line), ("m", 0.0, &vec![1.5], 10));
    assert_eq!((rate.derivative_of, rate.causality), (Some(0), Causality::Local));
    let Kind::Enumeration(literals) = &g.kind else { panic!("{:?}", g.kind) };
    assert_eq!((&*literals[1].0, literals[1].1, g.number(read.version)), ("fast", 2, Some(Number::Int32)));
    assert_eq!((b.changes, b.initial, &b.start), (Changes::Discrete, Initial::Exact, &vec![1.0]));
    assert_eq!((read.states.len(), read.states[0].depends.as_deref()), (1, Some(&[0, 3][..])));
}

#[test]
fn a_description_of_version_three() {
    let text = r#"<fmiModelDescription fmiVersion="3.0" modelName="A" instantiationToken="t">
      <ModelExchange modelIdentifier="A" needsCompletedIntegratorStep="true"/>
      <ModelVariables>
        <UInt64 name="n" valueReference="9" causality="structuralParameter" variability="fixed" start="3"/>
        <Float64 name="x" valueReference="1" start="1"><Dimension valueReference="9"/><Dimension start="2"/><Alias name="z" displayUnit="mm"/></Float64>
        <Float64 name="der(x)" valueReference="2" derivative="1"><Dimension valueReference="9"/><Dimension start="2"/></Float64>
        <String name="s" valueReference="3" causality="parameter" variability="fixed"><Start value="a b"/></String>
      </ModelVariables>
      <ModelStructure><ContinuousStateDerivative valueReference="2"/><EventIndicator valueReference="1"/></ModelStructure>
    </fmiModelDescription>"#;
    let read = Description::read(text.as_bytes()).unwrap();
    assert_eq!((read.state_count(), read.indicators), (6, 6));
    assert_eq!((read.variables[1].sizes.as_slice(), read.variables[1].start.len()), (&[3, 2][..], 6));
    assert_eq!(read.variables[3].text.as_deref(), Some("a b"));
    assert_eq!((&*read.variables[4].name, &*read.variables[4].display_unit), ("z", "mm"));
    assert!(read.exchange.unwrap().needs_completed_steps);
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    for (old, new, said) in [
        ("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"", "line 2: the unit is of version 1.0"),
        ("guid=\"g\"", "", "line 2: `fmiModelDescription` has no `guid`"),
        (
            "modelIdentifier=\"A\"",
            "modelIdentifier=\"../A\"",
            "line 3: `modelIdentifier` is `../A`, which is not a name in C",
        ),
        ("declaredType=\"Length\"", "declaredType=\"Width\"", "line 10: there is no type `Width`"),
        ("start=\"1.5\"", "start=\"1,5\"", "line 10: the start value `1,5` is not of its type"),
        ("derivative=\"1\"", "derivative=\"9\"", "line 11: `derivative` is 9, which is not a variable"),
        ("name=\"der(x)\"", "name=\"x\"", "line 11: the name `x` stands twice"),
        ("index=\"2\"", "index=\"1\"", "line 15: `x` does not say whose derivative it is"),
        ("dependencies=\"1 4\"", "dependencies=\"1 5\"", "line 15: 5 is not a variable of the unit"),
        ("</ModelVariables>", "", "line 16: "),
        ("<?xml version=\"1.0\"?>", "<!DOCTYPE x [<!ENTITY a \"b\">]>", "line 1: "),
    ] {
        let broken = TWO.replacen(old, new, 1);
        assert_ne!(broken, TWO, "{old}");
        let fault = Description::read(broken.as_bytes()).unwrap_err().to_string();
        assert!(fault.contains(&format!("modelDescription.xml, {said}")), "{old}: {fault}");
    }
}

#[test]
fn columns_of_one_colour_share_no_row() {
    // A band of width three needs three colours, however long it is; a full column meets all.
    let band: Vec<(u32, u32)> =
        (0..50u32).flat_map(|c| (c.saturating_sub(1)..=(c + 1).min(49)).map(move |r| (r, c))).collect();
    for (pairs, most) in [(band.clone(), 3), ([band, (0..50).map(|r| (r, 7)).collect()].concat(), 4)] {
        let pattern = Pattern::from_pairs(50, 50, &pairs);
        let colours = Colours::new(&pattern);
        assert!(colours.count() <= most, "{}", colours.count());
        for colour in 0..colours.count() as u32 {
            let mut rows: Vec<u32> = (0..50usize)
                .filter(|&column| colours.of_column[column] == colour)
                .flat_map(|column| colours.rows[colours.column(column)].to_vec())
                .collect();
            let count = rows.len();
            rows.sort_unstable();
            rows.dedup();
            assert_eq!(rows.len(), count);
        }
    }
}
