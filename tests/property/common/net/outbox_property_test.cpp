// Against a model: each slot holds its newest frame, the queue keeps its order, sizes add up.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <map>

#include "common/net/outbox.h"

namespace handloft::net {
namespace {

TEST(OutboxProperty, BehavesLikeAQueueAndAMap) {
  EXPECT_TRUE(rc::check("model", [] {
    Outbox outbox;
    std::deque<std::string> queue;
    std::map<std::string, std::string> slots;
    const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 12));
    int number = 0;
    for (const int step : steps) {
      const std::string text = std::to_string(++number);
      const Frame frame = std::make_shared<const std::string>(text);
      if (step < 4) {
        RC_ASSERT(outbox.push(frame));
        queue.push_back(text);
      } else if (step < 8) {
        const std::string key(1, static_cast<char>('a' + step));
        RC_ASSERT(outbox.put_latest({1, key}, frame));
        slots[key] = text;
      } else if (const auto taken = outbox.take()) {
        if (!queue.empty()) {
          RC_ASSERT(**taken == queue.front());
          queue.pop_front();
        } else {
          const auto held = std::find_if(slots.begin(), slots.end(),
                                         [&](const auto& slot) { return slot.second == **taken; });
          RC_ASSERT(held != slots.end());
          slots.erase(held);
        }
      } else {
        RC_ASSERT(queue.empty() && slots.empty());
      }
      std::size_t bytes = 0;
      for (const auto& held : queue) bytes += held.size();
      for (const auto& [key, held] : slots) bytes += held.size();
      RC_ASSERT(outbox.queued_bytes() == bytes);
      RC_ASSERT(outbox.queued_frames() == queue.size() + slots.size());
    }
  }));
}

}  // namespace
}  // namespace handloft::net
