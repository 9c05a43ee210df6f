// Comments on a design (U6): words pinned to a place, answered, resolved and deleted.

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <utility>

#include "server-model/model/annotations.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

Result<CommentPtr> require_comment(const Document& document, std::string_view id, std::string_view field) {
  const auto found = document.comments->find(id);
  if (found != document.comments->end()) return found->second;
  const bool printable = check_id(id, {}, Limits{}).ok();
  return make_error(
      ErrorCode::not_found,
      printable ? fmt::format("there is no comment \"{}\"", id) : std::string("there is no such comment"),
      std::string(field));
}

Status check_words(const std::string& text, const char* field, const Limits& limits) {
  if (text.empty()) return make_error(ErrorCode::invalid_argument, "found no text, expected some", field);
  return check_text(text, limits.max_comment_bytes, field);
}

std::string free_comment_id(const Document& document) {
  for (std::uint64_t n = document.next_comment;; ++n) {
    std::string id = fmt::format("comment-{}", n);
    if (!document.comments->contains(id)) return id;
  }
}

void put(Document& document, const CommentPtr& comment) {
  auto comments = std::make_shared<Comments>(*document.comments);
  comments->insert_or_assign(comment->id, comment);
  document.comments = std::move(comments);
}

/// The place and what it is pinned to, as the message says. `words`: "Comment on "Seat"".
Status pin(const Document& document, const v1::AddComment& request, const Limits& limits, Comment& comment,
           std::string& words) {
  if (!request.reply_to().empty()) {
    if (!request.entity().empty() || request.has_place()) {
      return make_error(ErrorCode::invalid_argument,
                        "found a place beside a comment to answer, expected one of them",
                        "add_comment.reply_to");
    }
    auto answered = require_comment(document, request.reply_to(), "add_comment.reply_to");
    if (!answered) return answered.error();
    comment.reply_to = request.reply_to();
    words = fmt::format("Answer {}", (*answered)->id);
    return {};
  }
  words = "Comment";
  if (!request.entity().empty()) {
    auto entity = require_entity(document, request.entity(), "add_comment.entity");
    if (!entity) return entity.error();
    comment.entity = (*entity)->id;
    comment.motion = (*entity)->motion;
    comment.place = centre_of(*entity);
    words = fmt::format("Comment on \"{}\"", (*entity)->name);
  } else if (!request.has_place()) {
    return make_error(ErrorCode::invalid_argument, "found neither a place nor an entity, expected one",
                      "add_comment.place");
  }
  if (!request.has_place()) return {};
  auto place = read_vector(request.place(), "add_comment.place", limits);
  if (!place) return place.error();
  comment.place = *place;
  return {};
}

}  // namespace

Result<Outcome> add_comment(const Document& document, const v1::Operation& operation,
                            const ApplyContext& context) {
  const v1::AddComment& request = operation.add_comment();
  if (auto status = check_words(request.text(), "add_comment.text", context.limits); !status)
    return status.error();
  auto comment = std::make_shared<Comment>();
  comment->id = request.id().empty() ? free_comment_id(document) : request.id();
  if (auto status = check_id(comment->id, "add_comment.id", context.limits); !status) return status.error();
  if (document.comments->contains(comment->id)) {
    return make_error(ErrorCode::already_exists,
                      fmt::format("there is a comment \"{}\" already", comment->id), "add_comment.id");
  }
  if (document.comments->size() >= context.limits.max_comments) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the document has {} comments, expected at most {}",
                                  document.comments->size(), context.limits.max_comments),
                      "add_comment.id");
  }
  Outcome outcome;
  if (auto status = pin(document, request, context.limits, *comment, outcome.words); !status)
    return status.error();
  comment->text = request.text();
  comment->author = operation.author();
  comment->client_id = operation.client_id();
  comment->made_ns = operation.made_ns();
  comment->number = document.next_comment;
  outcome.document = document;
  ++outcome.document.next_comment;
  *outcome.effective.mutable_add_comment() = request;
  outcome.effective.mutable_add_comment()->set_id(comment->id);
  put(outcome.document, comment);
  return outcome;
}

Result<Outcome> change_comment(const Document& document, const v1::Operation& operation,
                               const ApplyContext& context) {
  const v1::ChangeComment& request = operation.change_comment();
  auto found = require_comment(document, request.id(), "change_comment.id");
  if (!found) return found.error();
  const Comment& before = **found;
  if (!request.has_text() && !request.has_resolved()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to change, expected text or resolved",
                      "change_comment");
  }
  auto comment = std::make_shared<Comment>(before);
  if (request.has_text()) {
    if (auto status = check_words(request.text(), "change_comment.text", context.limits); !status)
      return status.error();
    const bool own = operation.client_id() == before.client_id ||
                     (!before.author.empty() && operation.author() == before.author);
    if (!own) {
      return make_error(
          ErrorCode::permission_denied,
          fmt::format("the words of \"{}\" are {}'s, who alone may change them", before.id,
                      before.author.empty() ? fmt::format("client {}", before.client_id) : before.author),
          "change_comment.text");
    }
    comment->text = request.text();
  }
  if (request.has_resolved()) comment->resolved = request.resolved();
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_change_comment() = request;
  outcome.words = fmt::format("Change {}", before.id);
  if (!request.has_text())
    outcome.words = fmt::format("{} {}", request.resolved() ? "Resolve" : "Reopen", before.id);
  if (comment->text == before.text && comment->resolved == before.resolved) return outcome;
  comment->changed_ns = operation.made_ns();
  put(outcome.document, comment);
  return outcome;
}

Result<Outcome> delete_comment(const Document& document, const v1::DeleteComment& request,
                               const ApplyContext&) {
  auto found = require_comment(document, request.id(), "delete_comment.id");
  if (!found) return found.error();
  Outcome outcome;
  outcome.document = document;
  auto comments = std::make_shared<Comments>(*document.comments);
  comments->erase(request.id());
  // An answer is younger than what it answers, but not by its id: until none is left over.
  for (bool more = true; more;) {
    more = false;
    for (auto each = comments->begin(); each != comments->end();) {
      const bool left_over = !each->second->reply_to.empty() && !comments->contains(each->second->reply_to);
      more = more || left_over;
      each = left_over ? comments->erase(each) : std::next(each);
    }
  }
  outcome.document.comments = std::move(comments);
  *outcome.effective.mutable_delete_comment() = request;
  outcome.words = fmt::format("Delete {}", request.id());
  return outcome;
}

}  // namespace handloft::model
