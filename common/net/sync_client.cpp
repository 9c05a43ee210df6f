#include <thread>

#include "common/net/client_handshake.h"

namespace handloft::net {

struct SyncClient::Implementation {
  Handshake handshake;
  ClientOptions options;
};

SyncClient::SyncClient(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
SyncClient::SyncClient(SyncClient&&) noexcept = default;
SyncClient& SyncClient::operator=(SyncClient&&) noexcept = default;
SyncClient::~SyncClient() = default;

Result<SyncClient> SyncClient::connect(const Endpoint& endpoint, const ClientOptions& options,
                                       const Clock& clock) {
  const SteadyTime deadline = std::chrono::steady_clock::now() + options.connect_timeout;
  for (;;) {
    Result<Handshake> handshake = shake_hands(endpoint, options, clock, options.handshake_timeout);
    if (handshake) {
      return SyncClient(std::make_unique<Implementation>(Implementation{std::move(*handshake), options}));
    }
    const bool in_time = std::chrono::steady_clock::now() + options.retry_interval < deadline;
    if (!worth_retrying(handshake.error()) || !in_time) return handshake.error();
    std::this_thread::sleep_for(options.retry_interval);
  }
}

Status SyncClient::send(const v1::Envelope& envelope) {
  const Result<Frame> frame = encode_frame(envelope, implementation_->options.max_frame_bytes);
  if (!frame) return frame.error();
  return send_bytes(**frame);
}

Status SyncClient::send_bytes(std::string_view bytes) {
  return send_all(implementation_->handshake.link, bytes,
                  std::chrono::steady_clock::now() + implementation_->options.handshake_timeout);
}

Result<v1::Envelope> SyncClient::receive(std::chrono::milliseconds timeout) {
  v1::Envelope envelope;
  Handshake& handshake = implementation_->handshake;
  const Status status =
      receive_one(handshake.link, handshake.decoder, envelope, std::chrono::steady_clock::now() + timeout);
  if (!status) return status.error();
  return envelope;
}

const v1::Welcome& SyncClient::welcome() const {
  return implementation_->handshake.welcome;
}
const ClockOffset& SyncClient::clock_offset() const {
  return implementation_->handshake.offset;
}
int SyncClient::fd() const {
  return implementation_->handshake.link.fd.get();
}

}  // namespace handloft::net
