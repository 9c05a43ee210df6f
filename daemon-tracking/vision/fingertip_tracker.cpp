#include "daemon-tracking/vision/fingertip_tracker.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace handloft::tracking {

namespace {

constexpr std::size_t table_side = 128;  // Chroma in steps of 2: finer than any camera's noise
constexpr std::uint8_t background_class = finger_count;
constexpr double longest_step_s = 0.2;
constexpr double solid_weight = 0.5;
constexpr std::size_t fewest_rim_samples = 8;
// Chroma of a blob's rim is mixed with what lies behind: a patch may be this much worse than its core.
constexpr double lowest_log_likelihood = -50.0;

double log_density(const ChromaGaussian& gaussian, const Eigen::Vector2d& chroma) {
  const Eigen::Vector2d difference = chroma - gaussian.mean;
  return -0.5 * difference.dot(gaussian.covariance.inverse() * difference) -
         std::log(2.0 * std::numbers::pi * std::sqrt(gaussian.covariance.determinant()));
}

}  // namespace

FingertipTracker::FingertipTracker(const FingertipTrackerOptions& options) : options_(options) {}

Result<FingertipTracker> FingertipTracker::create(const std::array<FingertipColour, finger_count>& colours,
                                                  const FingertipTrackerOptions& options) {
  FingertipTracker tracker(options);
  std::array<bool, finger_count> given{};
  for (const FingertipColour& colour : colours) {
    const auto finger = static_cast<std::size_t>(colour.finger);
    if (finger >= finger_count || given[finger])
      return make_error(ErrorCode::invalid_argument, "found a finger twice, expected each of the five once",
                        "rig.colours.finger");
    given[finger] = true;
    if (!std::isfinite(colour.cb) || !std::isfinite(colour.cr) || !(colour.sigma_cb > 0.1) ||
        !(colour.sigma_cr > 0.1) || !(colour.sigma_cb < 128) || !(colour.sigma_cr < 128))
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found ({}, {}) +- ({}, {}), expected finite chroma and deviations of 0.1..128",
                      colour.cb, colour.cr, colour.sigma_cb, colour.sigma_cr),
          "rig.colours");
    tracker.model_[finger].mean = {colour.cb, colour.cr};
    tracker.model_[finger].covariance =
        Eigen::Vector2d(colour.sigma_cb * colour.sigma_cb, colour.sigma_cr * colour.sigma_cr).asDiagonal();
  }
  if (options.whole_frame_every < 1 || options.whole_frame_when_lost_every < 1 ||
      options.max_blobs_per_finger < 1)
    return make_error(ErrorCode::invalid_argument, "found a count below 1", "fingertips.whole_frame_every");
  tracker.build_table();
  return tracker;
}

double FingertipTracker::log_ratio(int finger, double cb, double cr) const {
  const Eigen::Vector2d chroma(cb, cr);
  ChromaGaussian grey;
  grey.covariance = Eigen::Matrix2d::Identity() * options_.background_sigma * options_.background_sigma;
  const double background = (1.0 - options_.background_share) * std::exp(log_density(grey, chroma)) +
                            options_.background_share / (256.0 * 256.0);
  return log_density(model_[static_cast<std::size_t>(finger)], chroma) - std::log(background);
}

void FingertipTracker::build_table() {
  table_.assign(table_side * table_side, background_class);
  weight_.assign(table_side * table_side, 0.0f);
  for (std::size_t b = 0; b < table_side; ++b) {
    for (std::size_t r = 0; r < table_side; ++r) {
      const double cb = 2.0 * static_cast<double>(b) + 0.5, cr = 2.0 * static_cast<double>(r) + 0.5;
      const std::size_t index = b * table_side + r;
      double best = options_.min_log_ratio;
      for (int finger = 0; finger < finger_count; ++finger) {
        const ChromaGaussian& gaussian = model_[static_cast<std::size_t>(finger)];
        const Eigen::Vector2d difference = Eigen::Vector2d(cb, cr) - gaussian.mean;
        if (difference.dot(gaussian.covariance.inverse() * difference) >
            options_.gate_sigmas * options_.gate_sigmas)
          continue;
        const double ratio = log_ratio(finger, cb, cr);
        if (ratio <= best) continue;
        best = ratio;
        table_[index] = static_cast<std::uint8_t>(finger);
        // Soft towards the rim, where a chroma sample is part tip and part background.
        weight_[index] = static_cast<float>(1.0 - std::exp(-ratio));
      }
    }
  }
}

void FingertipTracker::reset() {
  tracks_ = {};
  frames_ = 0;
}

std::vector<FingertipTracker::Region> FingertipTracker::regions(const PlanarImage& image,
                                                                TimePoint capture_time) {
  const int width = image.cb.width_px, height = image.cb.height_px;
  bool missing = false;
  for (const Track& track : tracks_) missing = missing || !track.seen;
  const auto interval =
      static_cast<std::uint64_t>(missing ? options_.whole_frame_when_lost_every : options_.whole_frame_every);
  const Region whole{0, 0, width, height};
  if (frames_++ % interval == 0) return {whole};
  std::vector<Region> out;
  for (const Track& track : tracks_) {
    if (!track.seen) continue;
    const double step_s = std::clamp(to_seconds(capture_time - track.time), 0.0, longest_step_s);
    const Eigen::Vector2d motion = track.velocity_px_s * step_s;
    const Eigen::Vector2d centre = track.centre_px + motion;
    const double radius = options_.roi_radius_px + track.radius_px + 0.5 * motion.norm();
    const auto low = [](double value, int step) { return static_cast<int>(std::floor(value / step)); };
    Region region{
        low(centre.x() - radius, image.chroma_step_x), low(centre.y() - radius, image.chroma_step_y),
        low(centre.x() + radius, image.chroma_step_x) + 1, low(centre.y() + radius, image.chroma_step_y) + 1};
    region.x0 = std::clamp(region.x0, 0, width);
    region.x1 = std::clamp(region.x1, 0, width);
    region.y0 = std::clamp(region.y0, 0, height);
    region.y1 = std::clamp(region.y1, 0, height);
    if (region.x0 >= region.x1 || region.y0 >= region.y1) continue;
    out.push_back(region);
  }
  // A hand's regions overlap: their union is searched once, so that no patch is cut or counted twice.
  for (std::size_t i = 0; i < out.size();) {
    bool merged = false;
    for (std::size_t j = i + 1; j < out.size(); ++j) {
      if (out[i].x0 > out[j].x1 || out[j].x0 > out[i].x1 || out[i].y0 > out[j].y1 || out[j].y0 > out[i].y1)
        continue;
      out[i] = {std::min(out[i].x0, out[j].x0), std::min(out[i].y0, out[j].y0),
                std::max(out[i].x1, out[j].x1), std::max(out[i].y1, out[j].y1)};
      out.erase(out.begin() + static_cast<std::ptrdiff_t>(j));
      merged = true;
      break;
    }
    i = merged ? 0 : i + 1;
  }
  return out;
}

void FingertipTracker::search(const PlanarImage& image, const Region& region,
                              std::vector<FingertipBlob>& blobs) {
  const int width = region.x1 - region.x0, height = region.y1 - region.y0;
  const int step_x = image.chroma_step_x, step_y = image.chroma_step_y;
  mask_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::array<int, finger_count> counts{};
  const int luma_width = image.y.width_px, luma_height = image.y.height_px;
  for (int y = 0; y < height; ++y) {
    const int chroma_y = region.y0 + y;
    const int luma_y = std::min(chroma_y * step_y + step_y / 2, luma_height - 1);
    for (int x = 0; x < width; ++x) {
      const int chroma_x = region.x0 + x;
      int label = classify(image.cb.at(chroma_x, chroma_y), image.cr.at(chroma_x, chroma_y));
      if (label != background_class) {
        const int luma = image.y.at(std::min(chroma_x * step_x + step_x / 2, luma_width - 1), luma_y);
        if (luma < options_.min_luma || luma > options_.max_luma) {
          label = background_class;
        } else {
          ++counts[static_cast<std::size_t>(label)];
        }
      }
      mask_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(label);
    }
  }
  const cv::Mat classes(height, width, CV_8UC1, mask_.data());
  const double sample_area = step_x * step_y;
  struct Sums {
    double weight = 0, x = 0, y = 0, cb = 0, cr = 0;
    int count = 0;
    bool at_border = false;
    std::vector<cv::Point2f> solid;  // Samples that are surely tip
  };
  for (int finger = 0; finger < finger_count; ++finger) {
    if (counts[static_cast<std::size_t>(finger)] * sample_area < options_.min_area_px) continue;
    cv::Mat labels;
    const int components = cv::connectedComponents(classes == finger, labels, 8, CV_32S);
    std::vector<Sums> sums(static_cast<std::size_t>(components));
    for (int y = 0; y < height; ++y) {
      const int* row = labels.ptr<int>(y);
      for (int x = 0; x < width; ++x) {
        if (row[x] == 0) continue;
        Sums& sum = sums[static_cast<std::size_t>(row[x])];
        const int chroma_x = region.x0 + x, chroma_y = region.y0 + y;
        const unsigned cb = image.cb.at(chroma_x, chroma_y), cr = image.cr.at(chroma_x, chroma_y);
        const double weight = static_cast<double>(weight_[(cb >> 1U) * table_side + (cr >> 1U)]);
        sum.weight += weight;
        sum.x += weight * (chroma_x * step_x + 0.5 * (step_x - 1));
        sum.y += weight * (chroma_y * step_y + 0.5 * (step_y - 1));
        if (weight > solid_weight)
          sum.solid.emplace_back(
              static_cast<float>(chroma_x * step_x) + 0.5f * static_cast<float>(step_x - 1),
              static_cast<float>(chroma_y * step_y) + 0.5f * static_cast<float>(step_y - 1));
        sum.cb += weight * cb;
        sum.cr += weight * cr;
        ++sum.count;
        sum.at_border = sum.at_border || chroma_x == 0 || chroma_y == 0 ||
                        chroma_x == image.cb.width_px - 1 || chroma_y == image.cb.height_px - 1;
      }
    }
    std::vector<FingertipBlob> found;
    for (std::size_t i = 1; i < sums.size(); ++i) {
      const Sums& sum = sums[i];
      const double area = sum.count * sample_area;
      if (area < options_.min_area_px || area > options_.max_area_px || !(sum.weight > 0.0)) continue;
      FingertipBlob blob;
      blob.finger = static_cast<Finger>(finger);
      blob.centre_px = {sum.x / sum.weight, sum.y / sum.weight};
      blob.area_px = area;
      blob.at_border = sum.at_border;
      double variance =
          options_.centroid_sigma_px * options_.centroid_sigma_px + options_.centroid_area_px2 / area;
      if (sum.at_border) variance += options_.border_sigma_px * options_.border_sigma_px;
      if (!sum.at_border && sum.solid.size() >= fewest_rim_samples) {
        cv::Point2f centre;
        float radius = 0.0f;
        cv::minEnclosingCircle(sum.solid, centre, radius);
        const double rim = static_cast<double>(radius) + 0.5 * std::max(step_x, step_y);
        if (area < options_.hidden_fill * std::numbers::pi * rim * rim) {
          blob.centre_px = {static_cast<double>(centre.x), static_cast<double>(centre.y)};
          variance += options_.hidden_sigma_px * options_.hidden_sigma_px;
        }
      }
      blob.covariance = Eigen::Matrix2d::Identity() * variance;
      for (int other = 0; other < finger_count; ++other)
        blob.log_likelihood[static_cast<std::size_t>(other)] =
            std::max(lowest_log_likelihood, log_ratio(other, sum.cb / sum.weight, sum.cr / sum.weight));
      found.push_back(blob);
    }
    blobs.insert(blobs.end(), found.begin(), found.end());
  }
}

std::vector<FingertipBlob> FingertipTracker::track(const PlanarImage& image, TimePoint capture_time) {
  std::vector<FingertipBlob> blobs;
  if (image.cb.empty() || image.cr.empty() || image.y.empty() || image.cb.width_px != image.cr.width_px ||
      image.cb.height_px != image.cr.height_px)
    return blobs;
  for (const Region& region : regions(image, capture_time)) search(image, region, blobs);
  std::stable_sort(blobs.begin(), blobs.end(), [](const FingertipBlob& a, const FingertipBlob& b) {
    return a.finger != b.finger ? a.finger < b.finger : a.area_px > b.area_px;
  });
  std::array<int, finger_count> kept{};
  std::erase_if(blobs, [&](const FingertipBlob& blob) {
    return ++kept[static_cast<std::size_t>(blob.finger)] > options_.max_blobs_per_finger;
  });

  for (int finger = 0; finger < finger_count; ++finger) {
    Track& track = tracks_[static_cast<std::size_t>(finger)];
    const auto largest = std::find_if(blobs.begin(), blobs.end(), [&](const FingertipBlob& blob) {
      return static_cast<int>(blob.finger) == finger;
    });
    if (largest == blobs.end()) {
      track.seen = false;
      continue;
    }
    const double step_s = track.seen ? to_seconds(capture_time - track.time) : 0.0;
    const bool steady = step_s > 1e-4 && step_s < longest_step_s;
    track.velocity_px_s =
        steady ? Eigen::Vector2d((largest->centre_px - track.centre_px) / step_s) : Eigen::Vector2d(0, 0);
    track.seen = true;
    track.time = capture_time;
    track.centre_px = largest->centre_px;
    track.radius_px = std::sqrt(largest->area_px / std::numbers::pi);
  }
  return blobs;
}

}  // namespace handloft::tracking
