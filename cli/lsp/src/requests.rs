//! The requests: each method with what answers it.
//!
//! A request works on the documents as they were when it came.  One that was cancelled is not begun; long ones look whether they are.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use lsp_server::{ErrorCode, Request, RequestId, Response};
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest, DocumentSymbolRequest, ExecuteCommand,
    FoldingRangeRequest, Formatting, GotoDeclaration, GotoDefinition, GotoTypeDefinition, HoverRequest,
    InlayHintRequest, PrepareRenameRequest, RangeFormatting, References, Rename, SemanticTokensFullRequest,
    SemanticTokensRangeRequest, SignatureHelpRequest, WorkspaceSymbolRequest,
};
use lsp_types::{
    CompletionList, CompletionResponse, DocumentSymbolResponse, GotoDefinitionResponse, Location, SemanticTokens,
    SemanticTokensRangeResult, SemanticTokensResult, TextDocumentIdentifier, TextDocumentPositionParams, Uri,
    WorkspaceSymbolResponse,
};
use serde_json::Value;

use crate::check::{Checked, Watch, check};
use crate::checker::{Results, locked};
use crate::definition::{Wanted, definition};
use crate::documents::{Document, Documents};
use crate::session::{Session, Settings};
use crate::{
    actions, completion, folding, formatting, hints, hover, lenses, references, renaming, signature, symbols, tokens,
};

/// Requests without an answer yet, and whether the client has taken them back.
pub(crate) type Pending = Arc<Mutex<HashMap<RequestId, bool>>>;

/// A request with the state of everything when it came.
pub(crate) struct Job {
    /// The request.
    pub(crate) request: Request,
    /// The documents.
    pub(crate) documents: Documents,
    /// The settings.
    pub(crate) settings: Arc<Settings>,
}

/// What the client can do.
#[derive(Clone, Debug, Default)]
pub(crate) struct Client {
    /// Settings that it was given and that are not known.
    pub(crate) unknown_settings: Vec<String>,
    /// Commands that it has for models.
    pub(crate) commands: Vec<String>,
    /// A change of the workspace may rename files.
    pub(crate) renames_files: bool,
    /// It shows a file when asked to.
    pub(crate) shows_files: bool,
    /// It asks for hints again when told to.
    pub(crate) refreshes_hints: bool,
    /// It registers watchers of files when asked to.
    pub(crate) watches_files: bool,
}

/// Why a request has no answer.
struct Refused(ErrorCode, String);

/// Answers requests.
pub(crate) struct Requests {
    session: Session,
    results: Results,
    pending: Pending,
    client: Client,
}

/// An answer, and a file that the client may show with it.
pub(crate) struct Answer {
    /// The answer.
    pub(crate) response: Response,
    /// The file.
    pub(crate) shown: Option<Uri>,
    /// The request met a fault of ours.
    pub(crate) fault: Option<String>,
}

type Answered<T> = Result<T, Refused>;

impl Requests {
    /// Over the results of the checks.
    pub(crate) fn new(results: Results, pending: Pending, client: Client) -> Self {
        Self { session: Session::new(Arc::default()), results, pending, client }
    }

    /// Answers a request, whatever it is.
    pub(crate) fn answer(&mut self, job: Job) -> Answer {
        let Job { request, documents, settings } = job;
        let id = request.id.clone();
        let mut shown = None;
        if self.is_cancelled(&id) {
            locked(&self.pending).remove(&id);
            let response = Response::new_err(id, ErrorCode::RequestCanceled as i32, "cancelled".into());
            return Answer { response, shown, fault: None };
        }
        self.session.documents = documents;
        self.session.settings = settings;
        let method = request.method.clone();
        let done = catch_unwind(AssertUnwindSafe(|| self.dispatch(request, &mut shown)));
        let was_cancelled = locked(&self.pending).remove(&id) == Some(true);
        let (response, fault) = match done {
            _ if was_cancelled => (Response::new_err(id, ErrorCode::RequestCanceled as i32, "cancelled".into()), None),
            Ok(Ok(value)) => (Response::new_ok(id, value), None),
            Ok(Err(Refused(code, sentence))) => (Response::new_err(id, code as i32, sentence), None),
            Err(_) => {
                self.session.forget();
                let sentence = format!("a fault of the server in `{method}`");
                (Response::new_err(id, ErrorCode::InternalError as i32, sentence.clone()), Some(sentence))
            }
        };
        Answer { response, shown, fault }
    }

    fn is_cancelled(&self, id: &RequestId) -> bool {
        locked(&self.pending).get(id) == Some(&true)
    }

    /// One line for each method.
    fn dispatch(&mut self, request: Request, shown: &mut Option<Uri>) -> Answered<Value> {
        let id = request.id.clone();
        match request.method.as_str() {
            "textDocument/hover" => self.on::<HoverRequest>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position_params)?;
                // A question in passing is not worth a translation.
                let facts = this.known(&document).map_or_else(Vec::new, |checked| checked.facts.clone());
                Ok(hover::hover(&mut this.session, &document, position, &facts))
            }),
            "textDocument/definition" => self.on::<GotoDefinition>(request, |this, params| {
                this.declarations(&params.text_document_position_params, Wanted::Itself)
            }),
            "textDocument/typeDefinition" => self.on::<GotoTypeDefinition>(request, |this, params| {
                this.declarations(&params.text_document_position_params, Wanted::Class)
            }),
            "textDocument/declaration" => self.on::<GotoDeclaration>(request, |this, params| {
                this.declarations(&params.text_document_position_params, Wanted::Bases)
            }),
            "textDocument/completion" => self.on::<Completion>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position)?;
                let items = completion::completion(&mut this.session, &document, position);
                Ok(Some(CompletionResponse::List(CompletionList { is_incomplete: false, items })))
            }),
            "textDocument/signatureHelp" => self.on::<SignatureHelpRequest>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position_params)?;
                Ok(signature::signature(&mut this.session, &document, position))
            }),
            "textDocument/references" => self.on::<References>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position)?;
                let pending = this.pending.clone();
                let go_on = || locked(&pending).get(&id) != Some(&true);
                let asked = (position, params.context.include_declaration);
                Ok(Some(references::references(&mut this.session, &document, asked, &go_on)))
            }),
            "textDocument/documentHighlight" => self.on::<DocumentHighlightRequest>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position_params)?;
                Ok(Some(references::highlights(&mut this.session, &document, position)))
            }),
            "textDocument/prepareRename" => self.on::<PrepareRenameRequest>(request, |this, params| {
                let (document, position) = this.place(&params)?;
                let range = renaming::prepare_rename(&mut this.session, &document, position);
                Ok(Some(lsp_types::PrepareRenameResponse::Range(range.map_err(failed)?)))
            }),
            "textDocument/rename" => self.on::<Rename>(request, |this, params| {
                let (document, position) = this.place(&params.text_document_position)?;
                let pending = this.pending.clone();
                let go_on = || locked(&pending).get(&id) != Some(&true);
                let asked = (position, params.new_name.as_str(), this.client.renames_files);
                Ok(Some(renaming::rename(&mut this.session, &document, asked, &go_on).map_err(failed)?))
            }),
            "textDocument/documentSymbol" => self.on::<DocumentSymbolRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let found = symbols::document_symbols(&mut this.session, &document);
                Ok(Some(DocumentSymbolResponse::Nested(found)))
            }),
            "workspace/symbol" => self.on::<WorkspaceSymbolRequest>(request, |this, params| {
                let pending = this.pending.clone();
                let go_on = || locked(&pending).get(&id) != Some(&true);
                let found = symbols::workspace_symbols(&mut this.session, &params.query, &go_on);
                Ok(Some(WorkspaceSymbolResponse::Nested(found)))
            }),
            "textDocument/semanticTokens/full" => self.on::<SemanticTokensFullRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let data = tokens::semantic_tokens(&mut this.session, &document, None);
                Ok(Some(SemanticTokensResult::Tokens(SemanticTokens { result_id: None, data })))
            }),
            "textDocument/semanticTokens/range" => self.on::<SemanticTokensRangeRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let data = tokens::semantic_tokens(&mut this.session, &document, Some(params.range));
                Ok(Some(SemanticTokensRangeResult::Tokens(SemanticTokens { result_id: None, data })))
            }),
            "textDocument/foldingRange" => self.on::<FoldingRangeRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                Ok(Some(folding::folding(&mut this.session, &document)))
            }),
            "textDocument/formatting" => self.on::<Formatting>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                Ok(formatting::formatting(&this.session, &document, None))
            }),
            "textDocument/rangeFormatting" => self.on::<RangeFormatting>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                Ok(formatting::formatting(&this.session, &document, Some(params.range)))
            }),
            "textDocument/codeAction" => self.on::<CodeActionRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let checked = this.checked(&document);
                Ok(checked.map(|checked| actions::actions(&checked, params.range, &params.context)))
            }),
            "textDocument/inlayHint" => self.on::<InlayHintRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let facts = this.facts(&document);
                Ok(Some(hints::hints(&this.session, &document, &facts, params.range)))
            }),
            "textDocument/codeLens" => self.on::<CodeLensRequest>(request, |this, params| {
                let document = this.document(&params.text_document)?;
                let commands = this.client.commands.clone();
                Ok(Some(lenses::lenses(&mut this.session, &document, &commands)))
            }),
            "workspace/executeCommand" => self.on::<ExecuteCommand>(request, |this, params| {
                let done = lenses::execute(&mut this.session, &params.command, &params.arguments);
                let (value, file) = done.map_err(failed)?;
                *shown = file;
                Ok(Some(value))
            }),
            other => Err(Refused(ErrorCode::MethodNotFound, format!("`{other}` is not known here"))),
        }
    }

    fn on<R: lsp_types::request::Request>(
        &mut self,
        request: Request,
        answer: impl FnOnce(&mut Self, R::Params) -> Answered<R::Result>,
    ) -> Answered<Value> {
        let params = serde_json::from_value(request.params);
        let params = params.map_err(|error| Refused(ErrorCode::InvalidParams, error.to_string()))?;
        let result = answer(self, params)?;
        serde_json::to_value(result).map_err(|error| Refused(ErrorCode::InternalError, error.to_string()))
    }

    fn document(&self, document: &TextDocumentIdentifier) -> Answered<Document> {
        let uri = &document.uri;
        let found = self.session.documents.get(uri).cloned();
        found.ok_or_else(|| Refused(ErrorCode::InvalidParams, format!("`{}` is not open", uri.as_str())))
    }

    fn place(&self, params: &TextDocumentPositionParams) -> Answered<(Document, lsp_types::Position)> {
        Ok((self.document(&params.text_document)?, params.position))
    }

    fn declarations(
        &mut self,
        params: &TextDocumentPositionParams,
        wanted: Wanted,
    ) -> Answered<Option<GotoDefinitionResponse>> {
        let (document, position) = self.place(params)?;
        let found: Vec<Location> = definition(&mut self.session, &document, position, wanted);
        Ok((!found.is_empty()).then_some(GotoDefinitionResponse::Array(found)))
    }

    /// What a check of this very text found; it is made here where the other thread has not come to it.
    fn checked(&mut self, document: &Document) -> Option<Arc<Checked>> {
        if let Some(known) = self.known(document) {
            return Some(known);
        }
        let mut watch = Watch { changed: None, go_on: &|| true, first: &mut |_, _| {} };
        check(&mut self.session, document, &mut watch).map(Arc::new)
    }

    fn known(&self, document: &Document) -> Option<Arc<Checked>> {
        let known = locked(&self.results).get(&document.path).cloned();
        known.filter(|known| known.version == document.version)
    }

    fn facts(&mut self, document: &Document) -> Vec<hints::Fact> {
        self.checked(document).map_or_else(Vec::new, |checked| checked.facts.clone())
    }
}

fn failed(sentence: impl Into<String>) -> Refused {
    Refused(ErrorCode::RequestFailed, sentence.into())
}

#[cfg(test)]
mod tests {
    use lsp_server::{ErrorCode, Request, RequestId};
    use serde_json::json;

    use super::{Client, Job, Pending, Requests};
    use crate::checker::locked;
    use crate::documents::{Document, Documents};

    /// One that was taken back before its turn is refused, one that was not is answered, and neither is remembered.
    #[test]
    fn what_is_taken_back_is_not_begun() {
        let pending = Pending::default();
        let mut requests = Requests::new(Default::default(), pending.clone(), Client::default());
        let mut documents = Documents::default();
        documents.put(Document::new("file:///a.mo".parse().expect("an address"), 1, "model A end A;".into()));
        for (number, is_taken_back) in [(1, true), (2, false)] {
            let id = RequestId::from(number);
            locked(&pending).insert(id.clone(), is_taken_back);
            let request = Request::new(id, "workspace/symbol".into(), json!({ "query": "x" }));
            let answer = requests.answer(Job { request, documents: documents.clone(), settings: Default::default() });
            // What it is to be answered with is not even taken up.
            assert_eq!(requests.session.documents.iter().count(), usize::from(!is_taken_back));
            let answer = serde_json::to_value(&answer.response).expect("JSON");
            let code = answer["error"]["code"].as_i64();
            assert_eq!(code, is_taken_back.then_some(ErrorCode::RequestCanceled as i64), "{answer}");
        }
        assert!(locked(&pending).is_empty());
    }
}
