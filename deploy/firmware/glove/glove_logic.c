#include "glove_logic.h"

static void put16(uint8_t* to, uint16_t value) {
  to[0] = (uint8_t)value;
  to[1] = (uint8_t)(value >> 8);
}

static void put32(uint8_t* to, uint32_t value) {
  put16(to, (uint16_t)value);
  put16(to + 2, (uint16_t)(value >> 16));
}

static uint16_t get16(const uint8_t* from) {
  return (uint16_t)(from[0] | (uint16_t)((uint16_t)from[1] << 8));
}

static uint32_t get32(const uint8_t* from) {
  return get16(from) | (uint32_t)get16(from + 2) << 16;
}

uint32_t glove_crc32(const uint8_t* bytes, uint8_t size) {
  /* Half a byte at a time: 64 bytes of table, and 60 bytes take some 0.3 ms at 16 MHz. */
  static const uint32_t table[16] = {
      0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
      0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
  };
  uint32_t crc = 0xFFFFFFFFu;
  for (uint8_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    crc = (crc >> 4) ^ table[crc & 15u];
    crc = (crc >> 4) ^ table[crc & 15u];
  }
  return ~crc;
}

void glove_pack(const glove_state* state, uint8_t report[GLOVE_REPORT_SIZE]) {
  for (uint8_t i = 0; i < GLOVE_REPORT_SIZE; ++i) report[i] = 0;
  report[0] = GLOVE_REPORT_ID;
  report[1] = GLOVE_VERSION;
  put16(report + 2, state->flags);
  put16(report + 4, state->sequence);
  put32(report + 6, state->time_us);
  put16(report + 10, state->force);
  put16(report + 12, state->potentiometer);
  put16(report + 14, state->contacts);
  report[16] = state->battery_percent;
  put32(report + GLOVE_REPORT_SIZE - 4, glove_crc32(report, GLOVE_REPORT_SIZE - 4));
}

uint16_t glove_contacts(uint8_t pins) {
  return (uint16_t)(~pins & ((1u << GLOVE_PADS) - 1u));
}

uint16_t glove_median(uint16_t* samples, uint8_t count) {
  for (uint8_t i = 1; i < count; ++i) {
    const uint16_t value = samples[i];
    uint8_t at = i;
    for (; at > 0 && samples[at - 1] > value; --at) samples[at] = samples[at - 1];
    samples[at] = value;
  }
  return samples[count / 2];
}

void glove_range_default(glove_range* range) {
  range->force_zero = 0;
  range->force_full = GLOVE_ANALOGUE_MAX;
  range->potentiometer_low = 0;
  range->potentiometer_high = GLOVE_ANALOGUE_MAX;
  range->calibrated = false;
}

void glove_range_pack(const glove_range* range, uint8_t report[GLOVE_RANGE_SIZE]) {
  report[0] = GLOVE_RANGE_ID;
  report[1] = GLOVE_VERSION;
  put16(report + 2, range->force_zero);
  put16(report + 4, range->force_full);
  put16(report + 6, range->potentiometer_low);
  put16(report + 8, range->potentiometer_high);
  put16(report + 10, range->calibrated ? 1 : 0);
  put32(report + 12, glove_crc32(report, GLOVE_RANGE_SIZE - 4));
}

bool glove_range_parse(const uint8_t* report, uint16_t size, glove_range* range) {
  if (size != GLOVE_RANGE_SIZE || report[0] != GLOVE_RANGE_ID || report[1] != GLOVE_VERSION) return false;
  if (get32(report + 12) != glove_crc32(report, GLOVE_RANGE_SIZE - 4)) return false;
  glove_range read;
  read.force_zero = get16(report + 2);
  read.force_full = get16(report + 4);
  read.potentiometer_low = get16(report + 6);
  read.potentiometer_high = get16(report + 8);
  const uint16_t flags = get16(report + 10);
  if (flags > 1) return false;
  read.calibrated = flags == 1;
  if (read.force_full > GLOVE_ANALOGUE_MAX || read.force_zero >= read.force_full) return false;
  if (read.potentiometer_high > GLOVE_ANALOGUE_MAX || read.potentiometer_low >= read.potentiometer_high)
    return false;
  *range = read;
  return true;
}

bool glove_output_parse(const uint8_t* report, uint16_t size, glove_output* output) {
  if (size != GLOVE_OUTPUT_SIZE || report[0] != GLOVE_OUTPUT_ID || report[1] != GLOVE_VERSION) return false;
  const uint16_t length = get16(report + 6);
  if (length > GLOVE_LONGEST_PULSE_MS) return false;
  output->red = report[2];
  output->green = report[3];
  output->blue = report[4];
  output->vibration = report[5];
  output->vibration_ms = length;
  return true;
}

void glove_pulse_start(glove_pulse* pulse, const glove_output* output, uint32_t now_us) {
  pulse->began_us = now_us;
  pulse->length_us = (uint32_t)output->vibration_ms * 1000u;
  pulse->strength = output->vibration;
}

uint8_t glove_pulse_level(glove_pulse* pulse, uint32_t now_us) {
  /* A pulse that is over is forgotten, or it would begin again when the clock comes round. */
  if (now_us - pulse->began_us >= pulse->length_us) pulse->strength = 0;
  return pulse->strength;
}

uint16_t glove_due(glove_schedule* schedule, uint32_t now_us) {
  if (!schedule->started) {
    schedule->started = true;
    schedule->next_us = now_us + GLOVE_REPORT_PERIOD_US;
    return 1;
  }
  const int32_t late = (int32_t)(now_us - schedule->next_us);
  if (late < 0) return 0;
  const uint32_t periods = 1u + (uint32_t)late / GLOVE_REPORT_PERIOD_US;
  schedule->next_us += periods * GLOVE_REPORT_PERIOD_US;
  return periods > 0xFFFFu ? 0xFFFFu : (uint16_t)periods;
}
