//! The inputs of the function that is being called.

use hyd_instance::ClassId;
use hyd_instance::meaning::{Meaning, Member, Visible};
use hyd_syntax::tree::{ClassKind, Direction, Name};
use lsp_types::{Documentation, ParameterInformation, ParameterLabel, Position, SignatureHelp, SignatureInformation};

use crate::context::call_around;
use crate::documents::Document;
use crate::predefined::{Call, calls};
use crate::session::{Question, Session};

/// The signature for a place inside the parentheses of a call.
pub(crate) fn signature(session: &mut Session, document: &Document, position: Position) -> Option<SignatureHelp> {
    let byte = session.byte(document, position);
    let (function, count, named) = call_around(&document.text, byte)?;
    session.ask_document(document, |question| {
        let class = question.class_around(byte)?;
        let found = question.table.quietly(|table| {
            let (first, rest) = function.split_first()?;
            let start = table.named(class, &Name::from(first.as_str()))?;
            rest.iter().try_fold(start, |meaning, name| table.inside(&meaning, &Name::from(name.as_str())))
        });
        let function = match found {
            Some(Meaning::Class(function)) => function,
            // Those that are no values, as `connect`, have no meaning of their own.
            Some(Meaning::Builtin(_) | Meaning::Type(_)) | None => return predefined(&function, count),
            Some(_) => return None,
        };
        let inputs = inputs(question, function);
        let shown = shown(question, function, &inputs);
        let active = match named {
            Some(name) => inputs.iter().position(|input| *input.component.name.name == *name),
            None => Some(count).filter(|&count| count < inputs.len()),
        };
        let active = active.map(|at| at as u32);
        Some(SignatureHelp { signatures: vec![shown], active_signature: Some(0), active_parameter: active })
    })
}

/// The ways to call a function of the language; that one is shown first which takes the argument that is written.
fn predefined(function: &[String], count: usize) -> Option<SignatureHelp> {
    let [name] = function else { return None };
    let takes = |call: &Call, count: usize| count < call.takes.len() || call.takes.last() == Some(&"...");
    let calls: Vec<&Call> = calls(name).collect();
    let fitting = calls.iter().position(|call| takes(call, count)).unwrap_or_default();
    let active =
        calls.get(fitting).filter(|call| takes(call, count)).map(|call| count.min(call.takes.len() - 1) as u32);
    let signature = |call: &&Call| {
        let mut label = format!("{}(", call.name);
        let mut parameters = Vec::new();
        for (k, input) in call.takes.iter().enumerate() {
            label.push_str(if k > 0 { ", " } else { "" });
            let start = units(&label);
            label.push_str(input);
            parameters.push(ParameterInformation {
                label: ParameterLabel::LabelOffsets([start, units(&label)]),
                documentation: None,
            });
        }
        label.push(')');
        SignatureInformation {
            label,
            documentation: Some(Documentation::String(call.gives.into())),
            parameters: Some(parameters),
            active_parameter: None,
        }
    };
    let signatures: Vec<_> = calls.iter().map(signature).collect();
    let help = SignatureHelp { signatures, active_signature: Some(fitting as u32), active_parameter: active };
    (!help.signatures.is_empty()).then_some(help)
}

/// Offsets of labels are counted in UTF-16, whatever positions are.
fn units(text: &str) -> u32 {
    text.encode_utf16().count() as u32
}

/// What a function takes, or the fields that the constructor of a record takes, in order.
pub(crate) fn inputs(question: &mut Question<'_>, function: ClassId) -> Vec<Member> {
    let kind = question.table.class(function).def.kind;
    let elements = question.table.elements_of(function).into_iter();
    let members = elements.filter_map(|element| match element {
        Visible::Component(member) => Some(member),
        Visible::Class(..) => None,
    });
    members
        .filter(|member| match kind {
            ClassKind::Function => member.component.direction == Some(Direction::Input),
            ClassKind::Record => !member.component.prefixes.protected,
            _ => false,
        })
        .collect()
}

fn shown(question: &mut Question<'_>, function: ClassId, inputs: &[Member]) -> SignatureInformation {
    let mut label = format!("{}(", question.table.full_name(function));
    let mut parameters = Vec::new();
    for (k, input) in inputs.iter().enumerate() {
        if k > 0 {
            label.push_str(", ");
        }
        let component = &input.component;
        let class = component.class.parts.last().map_or("", |part| &*part.name);
        let mut text = format!("{class} {}", component.name.name);
        if let Some(value) = question.table.given(input, None) {
            text.push_str(&format!(" = {}", question.written(&value.value)));
        }
        let start = units(&label);
        label.push_str(&text);
        parameters.push(ParameterInformation {
            label: ParameterLabel::LabelOffsets([start, start + units(&text)]),
            documentation: component.description.as_deref().map(|text| Documentation::String(text.to_string())),
        });
    }
    label.push(')');
    let description = question.table.class(function).def.description.clone();
    SignatureInformation {
        label,
        documentation: description.map(|text| Documentation::String(text.to_string())),
        parameters: Some(parameters),
        active_parameter: None,
    }
}
