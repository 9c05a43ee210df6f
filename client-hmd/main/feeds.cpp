#include "client-hmd/main/feeds.h"

#include "client-hmd/main/desktop_link.h"

#include <cstdlib>
#include <utility>

namespace handloft::client {
namespace {

/// Who only looks takes nothing back and need not be known again.
ClientKey key_of(v1::Role role, const Logger& log) {
  if (role != v1::ROLE_EDITOR) return {};
  return ClientKey::open(std::getenv("XDG_STATE_HOME"), std::getenv("HOME"), log);
}

FeedOptions joining(FeedOptions options, const ClientKey& key, std::shared_ptr<const net::TlsContext> tls,
                    Invited invited) {
  if (options.role == v1::ROLE_EDITOR && invited == Invited::owner) options.role = v1::ROLE_OWNER;
  options.client_key = key.bytes();
  options.tls = std::move(tls);
  return options;
}

}  // namespace

Feeds::Feeds(const HmdOptions& options, const net::Endpoint& model, const Clock& clock, Logger log,
             std::shared_ptr<const net::TlsContext> tls, Invited invited)
    : server_(model),
      clock_(clock),
      daemon_(options.tracking),
      log_(std::move(log)),
      key_(key_of(feed_options(options).role, log_)),
      joining_(joining(feed_options(options), key_, std::move(tls), invited)),
      model_(ModelFeed::start(server_, clock_, log_.component("model"), joining_)) {
  if (!daemon_) return;
  tracking_ = TrackingFeed::start(*daemon_, clock, log_.component("tracking"));
  if (options.camera == CameraMode::head) want_film();
}

Status Feeds::follow_access() {
  const std::shared_ptr<const ModelState> state = model_->state();
  if (!state->denied || state->denied->code != ErrorCode::permission_denied) return {};
  const bool too_much = state->denied->field == "hello.role";
  if (!too_much || joining_.role == v1::ROLE_VIEWER) return *state->denied;
  switch (joining_.role) {
    case v1::ROLE_OWNER:
      joining_.role = v1::ROLE_EDITOR;
      break;
    case v1::ROLE_EDITOR:
      joining_.role = v1::ROLE_COMMENTER;
      break;
    default:
      joining_.role = v1::ROLE_VIEWER;
  }
  log_.info("the server says: {}; coming as less", state->denied->message);
  model_.reset();  // Before the next: two with one key would end each other's connections.
  model_ = ModelFeed::start(server_, clock_, log_.component("model"), joining_);
  return {};
}

void Feeds::want_film() {
  if (film_ == nullptr && daemon_) film_ = FilmFeed::start(*daemon_, log_.component("film"));
}

void Feeds::follow_daemon() {
  if (tracking_ == nullptr || film_ == nullptr) return;
  const std::uint64_t connects = tracking_->status().connects;
  if (connects > 1 && connects != film_connects_) film_->reconnect();
  film_connects_ = connects;
}

void Feeds::follow_users() {
  const bool same_hand =
      tracking_ != nullptr && (tracking_->status().connected || tracking_->status().end_of_recording);
  ghosts_.take(*model_->state(), same_hand ? TrackedHand::ours : TrackedHand::somebodys);
  pins_.follow(*model_->state()->scene);
}

double Feeds::latency_ms() const {
  return tracking_ == nullptr ? 0.0 : model_->statistics().capture_to_receipt.quantile_ms(0.5);
}

}  // namespace handloft::client
