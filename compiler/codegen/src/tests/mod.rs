//! Machine code and plans against the interpreter, against expressions evaluated one by one, and against closed forms.

mod bodies;
mod from_text;
mod hybrid;
mod native_matches_vm;
mod plans;
mod support;
