#include "server-model/geometry/trim_region.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::geometry {

namespace {

/// Of the domain's size: what two programs' rounding of the same bound may differ by.
constexpr double outside_tolerance = 1e-9;
constexpr std::size_t max_bands = 4096;

}  // namespace

Result<TrimRegion> TrimRegion::create(std::vector<TrimLoop> loops, const Vec2& lower, const Vec2& upper) {
  TrimRegion region;
  region.lower_ = lower;
  region.upper_ = upper;
  std::size_t count = 0;
  const Vec2 slack = outside_tolerance * (upper - lower);
  for (std::size_t l = 0; l < loops.size(); ++l) {
    TrimLoop& loop = loops[l];
    count += loop.size();
    if (count > max_vertices) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("more than {} places in the loops", max_vertices), "loops");
    }
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec2& at = loop[k];
      if (!at.allFinite() || (at - (lower - slack)).minCoeff() < 0 || ((upper + slack) - at).minCoeff() < 0) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found ({}, {}), expected a place in [{}, {}] x [{}, {}]", at.x(),
                                      at.y(), lower.x(), upper.x(), lower.y(), upper.y()),
                          fmt::format("loops[{}][{}]", l, k));
      }
      loop[k] = at.cwiseMax(lower).cwiseMin(upper);
    }
    loop.erase(std::unique(loop.begin(), loop.end()), loop.end());
    while (loop.size() > 1 && loop.front() == loop.back()) loop.pop_back();
    if (loop.size() < 3) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {} different places, expected three or more", loop.size()),
                        fmt::format("loops[{}]", l));
    }
    for (std::size_t k = 0; k < loop.size(); ++k) {
      region.segments_.push_back({loop[k], loop[(k + 1) % loop.size()]});
    }
  }
  region.loops_ = std::move(loops);
  region.bands_.resize(std::clamp<std::size_t>(region.segments_.size(), 1, max_bands));
  for (std::size_t s = 0; s < region.segments_.size(); ++s) {
    const Segment& segment = region.segments_[s];
    const auto [least, most] = std::minmax(segment.from.y(), segment.to.y());
    for (std::size_t b = region.band_of(least); b <= region.band_of(most); ++b) {
      region.bands_[b].push_back(static_cast<std::uint32_t>(s));
    }
  }
  return region;
}

std::size_t TrimRegion::band_of(double v) const {
  const double part = (v - lower_.y()) / (upper_.y() - lower_.y()) * static_cast<double>(bands_.size());
  return static_cast<std::size_t>(std::clamp(part, 0.0, static_cast<double>(bands_.size() - 1)));
}

bool TrimRegion::inside(const Vec2& uv) const {
  if (loops_.empty()) return true;
  bool odd = false;
  for (const std::uint32_t s : bands_[band_of(uv.y())]) {
    const Vec2 &a = segments_[s].from, &b = segments_[s].to;
    if ((a.y() > uv.y()) == (b.y() > uv.y())) continue;
    const double u = a.x() + (uv.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (u > uv.x()) odd = !odd;
  }
  return odd;
}

std::vector<TrimRegion::Part> TrimRegion::parts(std::span<const double> us,
                                                std::span<const double> vs) const {
  const auto cell = [](std::span<const double> lines, double at) {
    const auto above = std::upper_bound(lines.begin(), lines.end(), at);
    const auto index = above - lines.begin() - 1;
    return static_cast<int>(std::clamp<std::ptrdiff_t>(index, 0, std::ssize(lines) - 2));
  };
  std::vector<Part> parts;
  std::vector<double> cuts;
  for (const Segment& segment : segments_) {
    cuts.assign({0.0, 1.0});
    const Vec2 along = segment.to - segment.from;
    const auto cut = [&](std::span<const double> lines, int axis) {
      const auto [least, most] = std::minmax(segment.from[axis], segment.to[axis]);
      const auto begin = std::upper_bound(lines.begin(), lines.end(), least);
      for (auto line = begin; line != lines.end() && *line < most; ++line) {
        cuts.push_back(std::clamp((*line - segment.from[axis]) / along[axis], 0.0, 1.0));
      }
    };
    cut(us, 0);
    cut(vs, 1);
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
      if (cuts[c] == cuts[c + 1]) continue;
      Part part;
      part.from = segment.from + cuts[c] * along;
      part.to = cuts[c + 1] == 1 ? segment.to : Vec2(segment.from + cuts[c + 1] * along);
      const Vec2 middle = (part.from + part.to) / 2;
      part.i = cell(us, middle.x());
      part.j = cell(vs, middle.y());
      parts.push_back(part);
    }
  }
  return parts;
}

}  // namespace handloft::geometry
