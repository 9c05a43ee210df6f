#include "daemon-tracking/calibration/colours.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace handloft::tracking {
namespace {

/// Chroma samples are thinned to every other one in each axis: caps keep some dozens.
constexpr int thin = 2;
constexpr int table_side = 64;  // Chroma in steps of 4.
constexpr int most_peaks = 14;
constexpr double no_cap = -1e9;
constexpr double start_sigma = 9.0;
constexpr double trim_sigmas = 2.5;
/// A Gaussian cut at 2.5 sigmas in two dimensions shows this share of its standard deviation.
constexpr double trim_shrinks = 0.90;
constexpr double gate_sigmas = 4.0;  // Of FingertipTrackerOptions.

struct Chroma {
  Eigen::Vector2d cb_cr;
  double y;
};

struct Cluster {
  Eigen::Vector2d mean{0, 0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  double y = 0;
  std::size_t samples = 0;
};

double squared(const Eigen::Vector2d& difference, const Eigen::Matrix2d& covariance) {
  return difference.dot(covariance.inverse() * difference);
}

/// The mean and spread of the samples around a peak, trimmed again and again.
Cluster grow(const std::vector<Chroma>& samples, const Eigen::Vector2d& peak) {
  Cluster cluster;
  cluster.mean = peak;
  cluster.covariance = Eigen::Matrix2d::Identity() * start_sigma * start_sigma;
  for (int pass = 0; pass < 8; ++pass) {
    const Eigen::Matrix2d inverse = cluster.covariance.inverse();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    double luma = 0;
    std::size_t count = 0;
    for (const Chroma& sample : samples) {
      const Eigen::Vector2d difference = sample.cb_cr - cluster.mean;
      if (difference.dot(inverse * difference) > trim_sigmas * trim_sigmas) continue;
      sum += difference;
      squares += difference * difference.transpose();
      luma += sample.y;
      ++count;
    }
    if (count < 8) return cluster;
    const auto n = static_cast<double>(count);
    const Eigen::Vector2d shift = sum / n;
    cluster.mean += shift;
    cluster.covariance = (squares / n - shift * shift.transpose()) / (trim_shrinks * trim_shrinks);
    cluster.covariance += Eigen::Matrix2d::Identity();
    // Never wider than at the start: it would swallow its neighbour.
    const double widest = std::sqrt(cluster.covariance.diagonal().maxCoeff());
    if (widest > start_sigma) cluster.covariance *= (start_sigma / widest) * (start_sigma / widest);
    cluster.y = luma / n;
    cluster.samples = count;
  }
  return cluster;
}

/// Local maxima of the smoothed histogram, the largest first.
std::vector<std::pair<double, Eigen::Vector2d>> peaks_of(const std::vector<Chroma>& samples) {
  std::vector<double> table(std::size_t{table_side} * table_side, 0.0), smooth(table.size(), 0.0);
  const auto at = [](int b, int r) {
    return static_cast<std::size_t>(b) * table_side + static_cast<std::size_t>(r);
  };
  for (const Chroma& sample : samples) {
    const int b = std::clamp(static_cast<int>(sample.cb_cr.x() / 4), 0, table_side - 1);
    const int r = std::clamp(static_cast<int>(sample.cb_cr.y() / 4), 0, table_side - 1);
    table[at(b, r)] += 1;
  }
  for (int b = 0; b < table_side; ++b)
    for (int r = 0; r < table_side; ++r)
      for (int i = std::max(0, b - 1); i <= std::min(table_side - 1, b + 1); ++i)
        for (int j = std::max(0, r - 1); j <= std::min(table_side - 1, r + 1); ++j)
          smooth[at(b, r)] += table[at(i, j)];
  std::vector<std::pair<double, Eigen::Vector2d>> peaks;
  for (int b = 1; b + 1 < table_side; ++b)
    for (int r = 1; r + 1 < table_side; ++r) {
      const double mass = smooth[at(b, r)];
      bool highest = mass >= 9;
      for (int i = b - 1; i <= b + 1 && highest; ++i)
        for (int j = r - 1; j <= r + 1; ++j) {
          // Of equals the first one is the peak.
          const bool before = i < b || (i == b && j < r);
          if (before ? smooth[at(i, j)] >= mass : smooth[at(i, j)] > mass) highest = false;
        }
      if (highest) peaks.emplace_back(mass, Eigen::Vector2d(4 * b + 2, 4 * r + 2));
    }
  std::sort(peaks.begin(), peaks.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first
                              : std::pair(a.second.x(), a.second.y()) < std::pair(b.second.x(), b.second.y());
  });
  if (peaks.size() > most_peaks) peaks.resize(most_peaks);
  return peaks;
}

/// The assignment of different peaks to the fingers with the greatest score.
struct Assignment {
  std::vector<std::array<double, finger_count>> score;  // [peak][finger]
  std::array<int, finger_count> best{}, now{};
  double best_score = -std::numeric_limits<double>::max();

  void search(std::size_t finger, double so_far, std::vector<bool>& taken) {
    if (finger == finger_count) {
      if (so_far > best_score) {
        best_score = so_far;
        best = now;
      }
      return;
    }
    now[finger] = -1;
    search(finger + 1, so_far + no_cap * 1e-3, taken);
    for (std::size_t peak = 0; peak < score.size(); ++peak) {
      if (taken[peak] || score[peak][finger] <= no_cap) continue;
      taken[peak] = true;
      now[finger] = static_cast<int>(peak);
      search(finger + 1, so_far + score[peak][finger], taken);
      taken[peak] = false;
    }
  }
};

}  // namespace

std::string_view finger_name(Finger finger) {
  constexpr std::array<std::string_view, finger_count> names = {"thumb", "index", "middle", "ring", "little"};
  return names[static_cast<std::size_t>(finger)];
}

ColourLearner::ColourLearner(const std::array<FingertipColour, finger_count>& chart,
                             const ColourOptions& options)
    : chart_(chart), options_(options) {}

void ColourLearner::add(const PlanarImage& image) {
  if (image.cb.empty() || image.cr.empty()) return;
  const int width = image.cb.width_px / thin, height = image.cb.height_px / thin;
  if (width < 8 || height < 8 || (width_ != 0 && (width != width_ || height != height_))) return;
  width_ = width;
  height_ = height;
  if (seen_++ % every_ != 0) return;
  std::vector<Sample> frame;
  frame.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int cx = x * thin, cy = y * thin;
      const int lx = std::min(cx * image.chroma_step_x, image.y.width_px - 1),
                ly = std::min(cy * image.chroma_step_y, image.y.height_px - 1);
      frame.push_back({image.y.at(lx, ly), image.cb.at(cx, cy), image.cr.at(cx, cy)});
    }
  }
  kept_.push_back(std::move(frame));
  if (kept_.size() > options_.max_frames) {
    std::vector<std::vector<Sample>> fewer;
    for (std::size_t i = 0; i < kept_.size(); i += 2) fewer.push_back(std::move(kept_[i]));
    kept_ = std::move(fewer);
    every_ *= 2;
  }
}

Result<ColourCalibration> ColourLearner::learn() const {
  const auto refused = [](std::string words) {
    return make_error(ErrorCode::failed_precondition, std::move(words), "colours");
  };
  if (kept_.size() < options_.min_frames)
    return refused(
        fmt::format("found {} frames with colours, expected at least {}", kept_.size(), options_.min_frames));
  std::vector<Chroma> moving, still;
  const std::size_t pixels = kept_.front().size();
  std::vector<std::uint8_t> cb(kept_.size()), cr(kept_.size());
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t frame = 0; frame < kept_.size(); ++frame) {
      cb[frame] = kept_[frame][i].cb;
      cr[frame] = kept_[frame][i].cr;
    }
    const auto middle = static_cast<std::ptrdiff_t>(kept_.size() / 2);
    std::nth_element(cb.begin(), cb.begin() + middle, cb.end());
    std::nth_element(cr.begin(), cr.begin() + middle, cr.end());
    const double still_cb = cb[kept_.size() / 2], still_cr = cr[kept_.size() / 2];
    still.push_back({{still_cb, still_cr}, 0});
    for (const auto& frame : kept_) {
      const Sample& sample = frame[i];
      if (sample.y < options_.min_luma || sample.y > options_.max_luma) continue;
      if (std::max(std::abs(sample.cb - still_cb), std::abs(sample.cr - still_cr)) < options_.moved_chroma)
        continue;
      moving.push_back({{double(sample.cb), double(sample.cr)}, double(sample.y)});
    }
  }
  const auto peaks = peaks_of(moving);
  Assignment assignment;
  for (const auto& [mass, peak] : peaks) {
    auto& score = assignment.score.emplace_back();
    for (std::size_t finger = 0; finger < finger_count; ++finger) {
      const double distance =
          (peak - Eigen::Vector2d(chart_[finger].cb, chart_[finger].cr)).norm() / options_.hue_tolerance;
      score[finger] = distance > 2.0 ? no_cap : std::log(mass) - 2.0 * distance * distance;
    }
  }
  std::vector<bool> taken(peaks.size(), false);
  assignment.search(0, 0.0, taken);

  ColourCalibration made;
  std::array<Cluster, finger_count> clusters;
  for (std::size_t finger = 0; finger < finger_count; ++finger) {
    const auto name = finger_name(static_cast<Finger>(finger));
    if (assignment.best[finger] >= 0)
      clusters[finger] = grow(moving, peaks[static_cast<std::size_t>(assignment.best[finger])].second);
    if (clusters[finger].samples < options_.min_samples)
      return refused(fmt::format(
          "the {} cap was not seen: nothing that moved has a colour near (Cb {:.0f}, Cr {:.0f}), apart from "
          "the other caps' "
          "(found {} samples, expected {}). Spread the fingers before this camera, use the chart's hues, or "
          "more light",
          name, chart_[finger].cb, chart_[finger].cr, clusters[finger].samples, options_.min_samples));
    Cluster& cluster = clusters[finger];
    cluster.covariance *= options_.sigma_margin * options_.sigma_margin;
    FingertipColour& colour = made.colours[finger];
    colour.finger = static_cast<Finger>(finger);
    colour.y = cluster.y;
    colour.cb = cluster.mean.x();
    colour.cr = cluster.mean.y();
    colour.sigma_cb = std::max(options_.least_sigma, std::sqrt(cluster.covariance(0, 0)));
    colour.sigma_cr = std::max(options_.least_sigma, std::sqrt(cluster.covariance(1, 1)));
    cluster.covariance =
        Eigen::Vector2d(colour.sigma_cb * colour.sigma_cb, colour.sigma_cr * colour.sigma_cr).asDiagonal();
    made.samples[finger] = cluster.samples;
    const auto alike = std::count_if(still.begin(), still.end(), [&](const Chroma& pixel) {
      return squared(pixel.cb_cr - cluster.mean, cluster.covariance) < gate_sigmas * gate_sigmas;
    });
    made.lookalike_share[finger] = static_cast<double>(alike) / static_cast<double>(pixels);
  }
  for (std::size_t a = 0; a < finger_count; ++a)
    for (std::size_t b = a + 1; b < finger_count; ++b)
      made.pairs.push_back({static_cast<Finger>(a), static_cast<Finger>(b),
                            std::sqrt(squared(clusters[a].mean - clusters[b].mean,
                                              0.5 * (clusters[a].covariance + clusters[b].covariance)))});
  std::stable_sort(made.pairs.begin(), made.pairs.end(),
                   [](const ColourPair& a, const ColourPair& b) { return a.separation < b.separation; });
  const ColourPair& closest = made.pairs.front();
  StepResult& result = made.result;
  result.residual = closest.separation;
  result.unit = "sigmas apart";
  const auto worst = std::max_element(made.lookalike_share.begin(), made.lookalike_share.end());
  const auto alike = finger_name(static_cast<Finger>(worst - made.lookalike_share.begin()));
  if (closest.separation < options_.usable_separation) {
    result.verdict = Verdict::bad;
    result.words = fmt::format(
        "{} and {} are too alike: {:.1f} standard deviations apart, {:.0f} needed. Change one of these caps.",
        finger_name(closest.a), finger_name(closest.b), closest.separation, options_.usable_separation);
  } else if (*worst > options_.lookalike_share) {
    result.verdict = Verdict::usable;
    result.words =
        fmt::format("{:.1f} % of the background looks like the {} cap: take that thing out of sight.",
                    100 * *worst, alike);
  } else {
    result.verdict = closest.separation >= options_.good_separation ? Verdict::good : Verdict::usable;
    result.words = fmt::format("the closest pair, {} and {}, is {:.1f} standard deviations apart.",
                               finger_name(closest.a), finger_name(closest.b), closest.separation);
  }
  return made;
}

}  // namespace handloft::tracking
