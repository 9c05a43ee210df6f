#include "server-model/session/session_metrics.h"

#include <algorithm>
#include <filesystem>

#include "common/base/metrics_text.h"
#include "common/base/process_figures.h"
#include "common/base/version.h"

namespace handloft::session {

namespace {

constexpr std::size_t most_models_by_name = 64;
/// No model can be called so (check_model_name()).
constexpr const char* other_models = "(others)";

std::string_view word_of(Asked what) {
  switch (what) {
    case Asked::connection:
      return "connection";
    case Asked::tls:
      return "tls";
    case Asked::hello:
      return "hello";
    case Asked::pairing:
      return "pairing";
    case Asked::join:
      return "join";
    case Asked::operation:
      return "operation";
    case Asked::command:
      return "command";
    case Asked::query:
      return "query";
    case Asked::lease:
      return "lease";
    case Asked::hand:
      return "hand";
  }
  return "";
}

}  // namespace

SessionMetrics::OfModel& SessionMetrics::of_model(const std::string& name) {
  if (const auto found = models_.find(name); found != models_.end()) return found->second;
  return models_[models_.size() < most_models_by_name ? name : other_models];
}

void SessionMetrics::applied(const std::string& model, v1::Operation::BodyCase kind, Duration after) {
  applied_.add(after);
  const auto* field = v1::Operation::descriptor()->FindFieldByNumber(kind);
  const std::lock_guard lock(mutex_);
  ++operations_[field == nullptr ? "none" : field->name()];
  ++of_model(model).operations;
}

void SessionMetrics::applied_by_hand(const std::string& model, std::size_t count) {
  if (count == 0) return;
  const std::lock_guard lock(mutex_);
  operations_["by_hand"] += count;
  of_model(model).operations += count;
}

void SessionMetrics::refused(Asked what, ErrorCode why, const std::string& model) {
  const std::lock_guard lock(mutex_);
  ++refusals_[{std::string(word_of(what)), std::string(to_string(why))}];
  if (!model.empty()) ++of_model(model).refusals;
}

std::string SessionMetrics::text(const PresentFigures& present) const {
  MetricsText text;
  text.family("build_info", "gauge", "Which program this is");
  text.sample(1, metrics_label("version", version()) + "," + metrics_label("commit", version_commit()));
  {
    const std::lock_guard lock(mutex_);
    text.family("operations_total", "counter", "Operations that were applied");
    for (const auto& [kind, count] : operations_) text.sample(count, metrics_label("kind", kind));
    text.family("refusals_total", "counter",
                "What was asked for and refused, from connections to operations");
    for (const auto& [why, count] : refusals_)
      text.sample(count, metrics_label("asked", why.first) + "," + metrics_label("code", why.second));
    text.family("model_operations_total", "counter", "Operations that were applied to the model");
    for (const auto& [name, counted] : models_) text.sample(counted.operations, metrics_label("model", name));
    text.family("model_refusals_total", "counter", "What was refused of those who work on the model");
    for (const auto& [name, counted] : models_) text.sample(counted.refusals, metrics_label("model", name));
  }
  text.family("operation_applied_seconds", "histogram",
              "From the coming of an operation to its being applied");
  applied_.write(text);
  text.family("operation_durable_seconds", "histogram",
              "From the coming of an operation to its being on the disk");
  durable_.write(text);
  text.family("capture_to_delta_seconds", "histogram",
              "From the capture of a tracking frame to the composing of the delta that shows it");
  shown_.write(text);
  text.family("store_commit_seconds", "histogram", "How long a commit takes, with its flush to the disk");
  commits_->write(text);

  std::map<std::string, std::size_t> roles{{"viewer", 0}, {"commenter", 0}, {"editor", 0}, {"owner", 0}};
  std::size_t outbox = 0, largest = 0;
  std::uint64_t overflows = 0;
  for (const ClientFigures& client : present.clients) {
    ++roles[client.role];
    outbox += client.outbox_bytes;
    largest = std::max(largest, client.outbox_bytes);
    overflows += client.overflows;
  }
  text.family("clients", "gauge", "Who is connected");
  for (const auto& [role, count] : roles) text.sample(count, metrics_label("role", role));
  text.family("clients_served_total", "counter", "Who has been connected since the start");
  text.sample(present.clients_served);
  text.family("outbox_bytes", "gauge", "What waits to be sent to all clients");
  text.sample(outbox);
  text.family("outbox_largest_bytes", "gauge", "What waits to be sent to the slowest client");
  text.sample(largest);
  text.family("outbox_overflows", "gauge", "How often those who are connected had to begin anew");
  text.sample(overflows);

  text.family("packed_bytes", "gauge", "What is kept of packed points and meshes for those who join");
  text.sample(present.packs.bytes);
  text.family("packed_total", "counter", "Clouds of points and meshes that were packed for viewers");
  text.sample(present.packs.packed);
  text.family("packed_shared_total", "counter", "Those that were there already and were sent again");
  text.sample(present.packs.shared);

  text.family("models", "gauge", "Models that are open");
  text.sample(present.models.size());
  const auto of_each = [&](std::string_view name, std::string_view type, std::string_view help, auto value) {
    text.family(name, type, help);
    for (const ModelFigures& model : present.models) {
      if (const auto number = value(model)) text.sample(*number, metrics_label("model", model.name));
    }
  };
  of_each("model_sequence", "counter", "Operations of the model",
          [](const ModelFigures& model) { return std::optional(model.sequence); });
  of_each("model_clients", "gauge", "Who works on the model",
          [](const ModelFigures& model) { return std::optional(model.clients); });
  of_each("model_silence_seconds", "gauge", "Since the model's thread has answered last",
          [](const ModelFigures& model) { return std::optional(model.silence_s); });
  const auto kept = [](auto member) {
    return [member](const ModelFigures& model) {
      using Number = std::remove_cvref_t<decltype(model.*member)>;
      return model.kept ? std::optional<Number>(model.*member) : std::optional<Number>();
    };
  };
  of_each("store_durable_sequence", "counter", "Operations that are on the disk",
          kept(&ModelFigures::durable_sequence));
  of_each("store_bytes", "gauge", "Size of the model's file with its write-ahead log",
          kept(&ModelFigures::file_bytes));
  of_each("store_recovery_seconds", "gauge", "How long the model took to open",
          kept(&ModelFigures::recovery_s));
  of_each("store_writable", "gauge", "1: operations are kept; 0: the disk is full or failed",
          [](const ModelFigures& model) {
            return model.kept ? std::optional<int>(model.writable ? 1 : 0) : std::optional<int>();
          });
  add_process_figures(text, process_figures());
  return text.take();
}

std::string role_word(v1::Role role) {
  constexpr std::string_view before = "ROLE_";
  std::string word = v1::Role_Name(role);
  if (word.starts_with(before)) word.erase(0, before.size());
  std::transform(word.begin(), word.end(), word.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return word;
}

std::uint64_t file_bytes(const std::string& file) {
  std::uint64_t sum = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code missing;
    const auto size = std::filesystem::file_size(file + suffix, missing);
    if (!missing) sum += size;
  }
  return sum;
}

}  // namespace handloft::session
