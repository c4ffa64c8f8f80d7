//! One text out of the files of a package, so that a model runs where its package is not.
//!
//! Files of a package stored as a folder begin with `within P;`; here each class is written into its package, right after the
//! package's description.  Only the heads of the files are read.

use hyd_compiler::head;

/// Puts texts together: packages first, each with its classes, then texts that belong to no package.
pub(crate) fn bundle(texts: &[String]) -> String {
    let mut root = Package::default();
    for text in texts {
        let head = head(text);
        match (head.package, head.elements) {
            (Some(name), Some(elements)) => {
                let mut path = head.within;
                path.push(name);
                let (front, back) = (&text[head.after_within..elements], &text[elements..]);
                root.at(&path).own = Some((front.trim_start().to_string(), back.trim().to_string()));
            }
            _ => root.at(&head.within).classes.push(text[head.after_within..].trim().to_string()),
        }
    }
    root.print_inside()
}

#[derive(Default)]
struct Package {
    /// Its text up to the end of its description, and from there on.
    own: Option<(String, String)>,
    classes: Vec<String>,
    inside: Vec<(String, Package)>,
}

impl Package {
    fn at(&mut self, path: &[String]) -> &mut Package {
        let Some((first, rest)) = path.split_first() else { return self };
        let position = match self.inside.iter().position(|(name, _)| name == first) {
            Some(position) => position,
            None => {
                self.inside.push((first.clone(), Package::default()));
                self.inside.len() - 1
            }
        };
        self.inside[position].1.at(rest)
    }

    fn print_inside(&self) -> String {
        let mut text = String::new();
        for (name, package) in &self.inside {
            let inside = package.print_inside();
            match &package.own {
                None => text.push_str(&format!("package {name}\n{inside}end {name};\n")),
                Some((front, back)) => text.push_str(&format!("{front}\n{inside}{back}\n")),
            }
        }
        for class in &self.classes {
            text.push_str(class);
            text.push_str("\n\n");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::bundle;

    #[test]
    fn classes_go_into_their_packages() {
        let texts = [
            "// first\nwithin;\npackage P \"it says \\\"within\\\"\"\n  annotation(version = \"1\");\nend P;\n"
                .to_string(),
            "within P;\nmodel A \"a\"\nend A;\n".to_string(),
            "within P.Q;\nmodel B\nend B;\n".to_string(),
            "model C\nend C;\n".to_string(),
        ];
        let text = bundle(&texts);
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("`{part}` is missing in {text}"));
        assert!(at("package P") < at("package Q") && at("model B") < at("end Q;") && at("end Q;") < at("model A"));
        assert!(at("model A") < at("annotation(version") && at("end P;") < at("model C"));
        assert!(!text.contains("within P"));
    }

    /// Every legal head is understood: quoted names, prefixes, descriptions of several strings, blanks around dots.
    #[test]
    fn heads_of_all_forms_give_one_package() {
        let bundled = |package: &str, within: &str| {
            bundle(&[package.to_string(), format!("within {within};\nmodel A\nend A;\n")])
        };
        let model = "model A\nend A;\n\n";
        assert_eq!(
            bundled("package 'my lib' \"d\"\nend 'my lib';", "'my lib'"),
            format!("package 'my lib' \"d\"\n{model}end 'my lib';\n")
        );
        assert_eq!(bundled("final package P\nend P;", "P"), format!("final package P\n{model}end P;\n"));
        assert_eq!(
            bundled("package P \"a\" +\n\"b\" annotation(x = 1);\nend P;", "P"),
            format!("package P \"a\" +\n\"b\"\n{model}annotation(x = 1);\nend P;\n")
        );
        assert_eq!(
            bundled("within P . Q ;\npackage R\nend R;", "P . Q . R"),
            format!("package P\npackage Q\npackage R\n{model}end R;\nend Q;\nend P;\n")
        );
        assert_eq!(bundled("package P = Q;", "R"), format!("package R\n{model}end R;\npackage P = Q;\n\n"));
    }
}
