/* What the glove computes, without its hardware: reports and their checksum, range, light and vibration,
 * timing. Built for the ATmega32U4 and, for the tests, for the computer that runs them. The layouts are those
 * of daemon-tracking/source/glove_report.h. No allocation, no floating point, nothing blocks. */
#ifndef HANDLOFT_GLOVE_LOGIC_H
#define HANDLOFT_GLOVE_LOGIC_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  GLOVE_REPORT_SIZE = 64,
  GLOVE_OUTPUT_SIZE = 8,
  GLOVE_RANGE_SIZE = 16,
  GLOVE_REPORT_ID = 1,
  GLOVE_OUTPUT_ID = 2,
  GLOVE_RANGE_ID = 3,
  GLOVE_VERSION = 1,
  GLOVE_ANALOGUE_MAX = 1023,
  GLOVE_LONGEST_PULSE_MS = 1000,
  GLOVE_PADS = 6, /* index, middle, ring, little, thumb, table: bits 0 to 5 */
  GLOVE_REPORT_PERIOD_US = 4000,
  GLOVE_SAMPLES = 5, /* of each analogue value in a report */
};

enum { GLOVE_FLAG_RESTARTED = 1 << 1 };

typedef struct {
  uint16_t flags;
  uint16_t sequence;
  uint32_t time_us;
  uint16_t force;
  uint16_t potentiometer;
  uint16_t contacts;
  uint8_t battery_percent;
} glove_state;

/* CRC-32 of IEEE 802.3. */
uint32_t glove_crc32(const uint8_t* bytes, uint8_t size);

void glove_pack(const glove_state* state, uint8_t report[GLOVE_REPORT_SIZE]);

/* The pads pull their pins low: `pins` has pad i's level in bit i. Raw on purpose: the daemon debounces. */
uint16_t glove_contacts(uint8_t pins);

/* The middle one of the samples, which are put in order: single spikes are the converter's. At least one. */
uint16_t glove_median(uint16_t* samples, uint8_t count);

typedef struct {
  uint16_t force_zero, force_full;
  uint16_t potentiometer_low, potentiometer_high;
  bool calibrated;
} glove_range;

/* That of a glove that was never calibrated. */
void glove_range_default(glove_range* range);
void glove_range_pack(const glove_range* range, uint8_t report[GLOVE_RANGE_SIZE]);
/* False for anything but a good range report, as it comes from the computer or from the EEPROM; `range` is
 * then untouched. */
bool glove_range_parse(const uint8_t* report, uint16_t size, glove_range* range);

typedef struct {
  uint8_t red, green, blue;
  uint8_t vibration;
  uint16_t vibration_ms;
} glove_output;

/* False for anything but a good output report; `output` is then untouched. */
bool glove_output_parse(const uint8_t* report, uint16_t size, glove_output* output);

/* One pulse of vibration, ended by time even if the computer falls silent. */
typedef struct {
  uint32_t began_us;
  uint32_t length_us;
  uint8_t strength;
} glove_pulse;

void glove_pulse_start(glove_pulse* pulse, const glove_output* output, uint32_t now_us);
uint8_t glove_pulse_level(glove_pulse* pulse, uint32_t now_us);

/* When the next report is due: every GLOVE_REPORT_PERIOD_US without drift; after a stall the missed ones are
 * left out and counted in the sequence. */
typedef struct {
  uint32_t next_us;
  bool started;
} glove_schedule;

/* How many periods have come due at `now_us`: 0 most of the time, 1 in time, more after a stall. */
uint16_t glove_due(glove_schedule* schedule, uint32_t now_us);

#ifdef __cplusplus
}
#endif
#endif
