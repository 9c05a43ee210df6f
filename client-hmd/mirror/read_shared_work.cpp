#include "client-hmd/mirror/read_shared_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace handloft::client {
namespace {

Error too_many(const char* field, int found, std::size_t limit) {
  return make_error(ErrorCode::resource_exhausted, fmt::format("found {}, expected at most {}", found, limit),
                    field);
}

Status check_bytes(const std::string& field, const std::string& text, std::size_t limit) {
  if (text.size() <= limit) return {};
  return make_error(ErrorCode::data_corrupt,
                    fmt::format("found {} bytes, expected at most {}", text.size(), limit), field);
}

/// All of them at most `limit` bytes.
Status check_texts(const std::string& field, std::initializer_list<const std::string*> texts,
                   std::size_t limit) {
  for (const std::string* text : texts) {
    if (const Status good = check_bytes(field, *text, limit); !good) return good;
  }
  return {};
}

bool within(double value, double limit) {
  return std::isfinite(value) && std::abs(value) <= limit;
}

std::string cut(const std::string& text, std::size_t bytes) {
  return text.substr(0, bytes);
}

}  // namespace

SavedState saved_state(const Storage& storage, std::uint64_t sequence) {
  if (!storage.told) return SavedState::unknown;
  if (!storage.problem.empty()) return SavedState::failing;
  if (!storage.kept) return SavedState::not_kept;
  return storage.durable_sequence >= sequence ? SavedState::saved : SavedState::saving;
}

std::vector<const PinnedComment*> open_threads(const std::vector<PinnedComment>& comments) {
  std::vector<const PinnedComment*> open;
  for (const PinnedComment& comment : comments) {
    if (comment.reply_to.empty() && !comment.resolved) open.push_back(&comment);
  }
  return open;
}

Result<Storage> read_storage(const v1::StorageState& state, const MirrorLimits& limits) {
  if (const Status good = check_bytes("storage.problem", state.problem(), limits.max_long_text_bytes);
      !good) {
    return good.error();
  }
  return Storage{true, state.kept(), state.durable_sequence(), state.problem()};
}

Result<std::shared_ptr<const std::vector<PinnedComment>>> read_comments(const v1::CommentsState& state,
                                                                        const MirrorLimits& limits) {
  if (static_cast<std::size_t>(state.comments_size()) > limits.max_comments) {
    return too_many("comments", state.comments_size(), limits.max_comments);
  }
  auto comments = std::make_shared<std::vector<PinnedComment>>();
  std::unordered_set<std::string_view> ids;
  std::size_t bytes = 0;
  for (const v1::Comment& one : state.comments()) {
    const std::string field = fmt::format("comments[{}]", comments->size());
    if (one.id().empty() || !ids.insert(one.id()).second) {
      return make_error(ErrorCode::data_corrupt, "expected an id of its own", field + ".id");
    }
    if (const Status good = check_texts(field, {&one.id(), &one.entity(), &one.reply_to(), &one.author()},
                                        limits.max_text_bytes);
        !good) {
      return good.error();
    }
    if (const Status good = check_bytes(field + ".text", one.text(), limits.max_long_text_bytes); !good) {
      return good.error();
    }
    bytes += one.text().size();
    if (bytes > limits.max_comments_bytes) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("found more than {} bytes of text", limits.max_comments_bytes),
                        "comments");
    }
    PinnedComment comment;
    comment.id = one.id();
    comment.text = one.text();
    comment.entity = one.entity();
    comment.reply_to = one.reply_to();
    comment.resolved = one.resolved();
    comment.author = one.author();
    comment.made_ns = std::max<std::int64_t>(0, one.made_ns());
    comment.client_id = one.client_id();
    if (one.has_place()) {
      const double limit = limits.max_coordinate_m;
      if (!within(one.place().x(), limit) || !within(one.place().y(), limit) ||
          !within(one.place().z(), limit)) {
        return make_error(ErrorCode::data_corrupt, fmt::format("expected numbers within {} m", limit),
                          field + ".place");
      }
      comment.placed = true;
      comment.x = static_cast<float>(one.place().x());
      comment.y = static_cast<float>(one.place().y());
      comment.z = static_cast<float>(one.place().z());
    }
    comments->push_back(std::move(comment));
  }
  return std::shared_ptr<const std::vector<PinnedComment>>(std::move(comments));
}

Result<std::shared_ptr<const std::vector<NamedVersion>>> read_versions(const v1::VersionsState& state,
                                                                       const MirrorLimits& limits) {
  if (static_cast<std::size_t>(state.versions_size()) > limits.max_versions) {
    return too_many("versions", state.versions_size(), limits.max_versions);
  }
  auto versions = std::make_shared<std::vector<NamedVersion>>();
  for (const v1::Version& one : state.versions()) {
    const std::string field = fmt::format("versions[{}]", versions->size());
    if (one.name().empty()) return make_error(ErrorCode::data_corrupt, "expected a name", field + ".name");
    if (const Status good =
            check_texts(field, {&one.name(), &one.author(), &one.alternative()}, limits.max_text_bytes);
        !good) {
      return good.error();
    }
    if (const Status good = check_bytes(field + ".note", one.note(), limits.max_long_text_bytes); !good) {
      return good.error();
    }
    versions->push_back(
        {one.name(), one.note(), one.author(), std::max<std::int64_t>(0, one.made_ns()), one.alternative()});
  }
  return std::shared_ptr<const std::vector<NamedVersion>>(std::move(versions));
}

std::shared_ptr<const std::vector<PersonHere>> read_people(const v1::People& people,
                                                           const MirrorLimits& limits) {
  auto here = std::make_shared<std::vector<PersonHere>>();
  for (const v1::Person& one : people.people()) {
    if (here->size() >= limits.max_people) break;
    here->push_back({one.client_id(), cut(one.user(), limits.max_text_bytes),
                     cut(one.name(), limits.max_text_bytes), cut(one.role(), limits.max_text_bytes)});
  }
  return here;
}

}  // namespace handloft::client
