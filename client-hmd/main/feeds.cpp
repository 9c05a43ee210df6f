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

FeedOptions joining(FeedOptions options, const ClientKey& key, std::shared_ptr<const net::TlsContext> tls) {
  options.client_key = key.bytes();
  options.tls = std::move(tls);
  return options;
}

}  // namespace

Feeds::Feeds(const HmdOptions& options, const net::Endpoint& model, const Clock& clock, Logger log,
             std::shared_ptr<const net::TlsContext> tls)
    : daemon_(options.tracking),
      log_(std::move(log)),
      key_(key_of(feed_options(options).role, log_)),
      model_(ModelFeed::start(model, clock, log_.component("model"),
                              joining(feed_options(options), key_, std::move(tls)))) {
  if (!daemon_) return;
  tracking_ = TrackingFeed::start(*daemon_, clock, log_.component("tracking"));
  if (options.camera == CameraMode::head) want_film();
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
}

double Feeds::latency_ms() const {
  return tracking_ == nullptr ? 0.0 : model_->statistics().capture_to_receipt.quantile_ms(0.5);
}

}  // namespace handloft::client
