#include "server-model/stream/sculpt_cache.h"

#include <utility>

namespace handloft::stream {

SculptCache::SculptCache(Run run, std::function<void()> ready, SculptMeshOptions options)
    : run_(std::move(run)), ready_(std::move(ready)), options_(options) {}

bool SculptCache::is_current(const Track& track) {
  return track.made && track.made->surface == track.wanted->surface &&
         track.made->trim == track.wanted->trim && track.made->reversed == track.wanted->reversed &&
         (track.moment == Moment::dragged || track.made_at == Moment::settled);
}

std::shared_ptr<const v1::Mesh> SculptCache::find(const model::SculptPtr& shape, Moment moment) {
  std::shared_ptr<Track> track;
  bool begins = false;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Track>& at = tracks_[shape->id];
    // Another entity may have had the id, in another alternative or before an undo.
    if (!at || at->wanted->initial != shape->initial) at = std::make_shared<Track>();
    track = at;
    track->wanted = shape;
    track->moment = moment;
    track->used_in_round = round_;
    begins = !track->working && !is_current(*track);
    if (begins) {
      track->working = true;
      ++statistics_.pending;
    }
  }
  if (begins) run_([this, track] { work(track); });
  const std::lock_guard lock(mutex_);
  return track->mesh;  // Already the newest when the job ran at once.
}

Result<v1::Mesh> SculptCache::make(Track& track, const model::SculptShape& shape, Moment moment) {
  const bool follows = track.mesher && track.mesher->fits(shape) &&
                       (moment == Moment::dragged || track.mesher->fine_enough(shape, options_));
  if (!follows) {
    std::uint64_t topology = 0;
    {
      const std::lock_guard lock(mutex_);
      topology = next_topology_++;
    }
    track.mesher.reset();
    Result<SculptMesher> mesher = SculptMesher::create(shape, topology, options_);
    if (!mesher) return mesher.error();
    track.mesher = *std::move(mesher);
  }
  return track.mesher->mesh(*shape.surface);
}

void SculptCache::work(const std::shared_ptr<Track>& track) {
  for (;;) {
    model::SculptPtr shape;
    Moment moment{};
    {
      const std::lock_guard lock(mutex_);
      const auto kept = tracks_.find(track->wanted->id);
      const bool forgotten = kept == tracks_.end() || kept->second != track;
      if (forgotten || is_current(*track)) {
        track->working = false;
        --statistics_.pending;
        return;
      }
      shape = track->wanted;
      moment = track->moment;
    }
    Result<v1::Mesh> mesh = make(*track, *shape, moment);
    {
      const std::lock_guard lock(mutex_);
      track->made = shape;
      track->made_at = moment;
      if (mesh) {
        ++statistics_.made;
        track->mesh = std::make_shared<const v1::Mesh>(*std::move(mesh));
      } else {
        ++statistics_.failed;  // Seen in the report; the icons stay visible.
        track->mesh = nullptr;
      }
    }
    ready_();
  }
}

void SculptCache::begin_round() {
  const std::lock_guard lock(mutex_);
  ++round_;
}

void SculptCache::end_round() {
  const std::lock_guard lock(mutex_);
  std::erase_if(tracks_, [this](const auto& item) { return item.second->used_in_round != round_; });
}

SculptCache::Statistics SculptCache::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace handloft::stream
