//! `hyd doc`: the page of the built-in library and of a folder: complete, well-formed, without a network.

use std::collections::BTreeSet;
use std::fs;

use crate::process::{Scratch, run};

/// Names and attributes of the tags, after every tag that opens has been seen to close where it should.
fn tags(page: &str) -> Vec<(String, String)> {
    let mut open: Vec<String> = Vec::new();
    let mut found = Vec::new();
    let mut rest = page;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        if rest.starts_with('!') {
            continue;
        }
        let end = rest.find('>').expect("a tag ends");
        let (tag, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "before `{}`", after.chars().take(80).collect::<String>());
            continue;
        }
        let (name, attributes) = tag.split_once([' ', '\n']).unwrap_or((tag, ""));
        found.push((name.trim_end_matches('/').to_string(), attributes.to_string()));
        if !tag.ends_with('/') {
            open.push(name.to_string());
        }
        if name == "script" || name == "style" {
            rest = &rest[rest.find(&format!("</{name}>")).expect("it ends")..];
        }
    }
    assert!(open.is_empty(), "{open:?}");
    found
}

fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    attributes.split_once(&format!("{name}=\"")).and_then(|(_, rest)| rest.split('"').next())
}

/// The part of the page about one class.
fn section<'a>(page: &'a str, class: &str) -> &'a str {
    let begin = page.find(&format!("<section id=\"{class}\">")).unwrap_or_else(|| panic!("no section {class}"));
    let rest = &page[begin..];
    &rest[..rest.find("</section>").unwrap()]
}

#[test]
fn the_page_of_the_library_is_whole() {
    let folder = Scratch::new();
    let outcome = run(folder.path(), &["doc", "--output", "hyd.html"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stdout);
    let page = folder.read("hyd.html");
    let tags = tags(&page);
    let ids: Vec<&str> = tags.iter().filter_map(|(_, a)| attribute(a, "id")).collect();
    let set: BTreeSet<&str> = ids.iter().copied().collect();
    assert_eq!(ids.len(), set.len(), "an id stands twice");
    // Nothing is loaded, and every link leads somewhere on the page.
    for (name, attributes) in &tags {
        assert!(attribute(attributes, "src").is_none(), "{name} {attributes}");
        if let Some(target) = attribute(attributes, "href") {
            let target = target.strip_prefix('#').unwrap_or_else(|| panic!("{target} leaves the page"));
            assert!(set.contains(target), "{target} is not on the page");
        }
    }
    // All classes of all files are there, with all parameters of one of them as they stand in its text.
    let sections = tags.iter().filter(|(name, _)| name == "section").count();
    assert!(sections > 280, "{sections} sections");
    let orifice = section(&page, "Hyd.Hydraulic.Components.SpoolEdge");
    for shown in [
        "<code>share</code>",
        "0 … 1",
        "<code>0.65</code>",
        ">kg/m3<",
        "≥ 1e-3",
        "Hyd.Hydraulic.Interfaces.Port",
        "<msqrt>",
        "Hyd.Hydraulic.Functions.orificeFlow",
        "from <a href=\"#Hyd.Hydraulic.Interfaces.TwoPort\"",
        "Merritt, Hydraulic Control Systems (1967)",
        "model SpoolEdge",
    ] {
        assert!(orifice.contains(shown), "{shown} is not in\n{orifice}");
    }
    // Each example has its picture, and a component that it uses shows it too.
    let examples = page.matches("<svg id=\"picture-Hyd.").count();
    assert!(examples >= 6, "{examples} pictures");
    assert!(
        section(&page, "Hyd.Translational.Components.StickingMass")
            .contains("#picture-Hyd.Translational.Examples.StickSlip")
    );
}

#[test]
fn a_folder_of_ones_own_is_shown_alone() {
    let folder = Scratch::new();
    fs::create_dir(folder.path().join("Mine")).unwrap();
    folder.write("Mine/package.hyd", "package Mine \"<b>my</b> parts\"\nend Mine;\n");
    folder.write(
        "Mine/Bore.hyd",
        "within Mine;\nmodel Bore \"a bore\"\n  extends Hyd.Hydraulic.Interfaces.TwoPort;\n  \
         parameter Hyd.Units.Length d(max = 1) = 2e-3 \"diameter\";\nequation\n  q = d^2/4*dp;\nend Bore;\n",
    );
    let outcome = run(folder.path(), &["doc", "Mine", "-o", "mine.html"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "2 classes, 0 pictures of examples in mine.html\n"));
    let page = folder.read("mine.html");
    tags(&page);
    assert!(page.contains("&lt;b&gt;my&lt;/b&gt; parts"));
    let bore = section(&page, "Mine.Bore");
    // Units and ports come from the library, which is not shown.
    for shown in ["<code>port_a</code>", "<span class=\"unit\">m</span>", "≤ 1", "<mfrac>"] {
        assert!(bore.contains(shown), "{shown} is not in\n{bore}");
    }
    assert!(!page.contains("id=\"Hyd."));
    // In the order of the alphabet unless the package says another; what it does not list comes last.
    folder.write("Mine/Axle.hyd", "within Mine;\nmodel Axle\nend Axle;\n");
    folder.write("Mine/Cam.hyd", "within Mine;\nmodel Cam\nend Cam;\n");
    for (order, wanted) in [("", ["Axle", "Bore", "Cam"]), ("Cam\n\nBore\nGone\n", ["Cam", "Bore", "Axle"])] {
        folder.write("Mine/package.order", order);
        assert_eq!(run(folder.path(), &["doc", "Mine", "-o", "mine.html"]).code, Some(0));
        let page = folder.read("mine.html");
        let package = section(&page, "Mine");
        for text in [&page[page.find("<nav").expect("a tree")..], package] {
            let places = wanted.map(|name| text.find(&format!("href=\"#Mine.{name}\"")).expect("linked"));
            assert!(places.is_sorted(), "{wanted:?} at {places:?}");
        }
    }
    // Files of the other ending are shown alike.
    let page = folder.read("mine.html");
    for name in ["package", "Bore", "Axle", "Cam"] {
        let file = |ending: &str| folder.path().join(format!("Mine/{name}.{ending}"));
        fs::rename(file("hyd"), file("mo")).unwrap();
    }
    assert_eq!(run(folder.path(), &["doc", "Mine", "-o", "mine.html"]).code, Some(0));
    assert_eq!(folder.read("mine.html").replace(".mo", ".hyd"), page);
    let outcome = run(folder.path(), &["doc", "none"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(1), "error: there is no folder `none`\n"));
}

#[test]
fn classes_that_need_each_other_are_shown() {
    // Whatever is asked of a class here leads to the bases of all others, once for each way round.
    let folder = Scratch::new();
    fs::create_dir(folder.path().join("Ring")).unwrap();
    let mut text = String::from("package Ring\n");
    for k in 0..12 {
        let bases: String = (0..12).map(|j| format!("    extends Ring.A{j}(x = {j});\n")).collect();
        text += &format!("  model A{k}\n{bases}    extends B{k};\n    Real x;\n  end A{k};\n");
    }
    text += "end Ring;\n";
    folder.write("Ring/package.hyd", &text);
    let outcome = run(folder.path(), &["doc", "Ring", "-o", "ring.html"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "13 classes, 0 pictures of examples in ring.html\n"));
    let page = folder.read("ring.html");
    tags(&page);
    assert_eq!(section(&page, "Ring.A3").matches("<code>x</code>").count(), 12);
}

/// Bases are followed as far as a model may have them, and what is left out is said.
#[test]
fn components_of_deep_bases_are_shown() {
    let folder = Scratch::new();
    fs::create_dir(folder.path().join("own")).unwrap();
    // Class `k` has `k` bases, one behind the other.
    let level = |k: usize| match k {
        0 => "  model C0\n    parameter Real far = 1;\n  end C0;\n".to_string(),
        k => format!("  model C{k}\n    extends C{};\n  end C{k};\n", k - 1),
    };
    let classes: String = (0..=101).map(level).collect();
    folder.write("own/package.hyd", format!("package own\n{classes}end own;\n"));
    let outcome = run(folder.path(), &["doc", "own", "-o", "own.html"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    let page = folder.read("own.html");
    for (class, is_whole) in [("own.C25", true), ("own.C100", true), ("own.C101", false)] {
        let section = section(&page, class);
        assert_eq!(section.contains("<code>far</code>"), is_whole, "{section}");
        assert_eq!(section.contains("more than 100 deep is left out"), !is_whole, "{section}");
    }
}
