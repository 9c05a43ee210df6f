#pragma once
// Memory for frames, used again: a camera of 60 frames a second must not ask the allocator for each. Frames
// may outlive the pool and be let go on any thread.

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace handloft::tracking {

class FramePool {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// At most `most_kept` unused buffers are kept for later: a frame each in capture, decoding, video ring and
  /// recording, and some to spare.
  explicit FramePool(std::size_t most_kept = 8) : free_(std::make_shared<Free>()) {
    free_->most_kept = most_kept;
  }

  /// An empty buffer, with the memory of an earlier frame where there is one.
  std::unique_ptr<Bytes> take() {
    {
      const std::lock_guard lock(free_->mutex);
      if (!free_->buffers.empty()) {
        std::unique_ptr<Bytes> buffer = std::move(free_->buffers.back());
        free_->buffers.pop_back();
        return buffer;
      }
    }
    return std::make_unique<Bytes>();
  }

  /// From now on shared and never changed; comes back to the pool with its last owner.
  std::shared_ptr<const Bytes> share(std::unique_ptr<Bytes> buffer) {
    return std::shared_ptr<const Bytes>(buffer.release(), [free = free_](const Bytes* done) {
      std::unique_ptr<Bytes> back(const_cast<Bytes*>(done));
      back->clear();
      const std::lock_guard lock(free->mutex);
      if (free->buffers.size() < free->most_kept) free->buffers.push_back(std::move(back));
    });
  }

  std::shared_ptr<const Bytes> copy(std::span<const std::uint8_t> from) {
    std::unique_ptr<Bytes> buffer = take();
    buffer->assign(from.begin(), from.end());
    return share(std::move(buffer));
  }

 private:
  struct Free {
    std::mutex mutex;
    std::vector<std::unique_ptr<Bytes>> buffers;
    std::size_t most_kept = 0;
  };
  std::shared_ptr<Free> free_;
};

}  // namespace handloft::tracking
