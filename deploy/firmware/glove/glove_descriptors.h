/* What the glove says of itself over USB (USB 2.0 chapter 9, HID 1.11). Plain constants, so that the tests of
 * the daemon read the very bytes that the glove sends. */
#ifndef HANDLOFT_GLOVE_DESCRIPTORS_H
#define HANDLOFT_GLOVE_DESCRIPTORS_H

#include <stdint.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#else
#define PROGMEM
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum {
  GLOVE_ENDPOINT_0_SIZE = 64,
  GLOVE_DEVICE_DESCRIPTOR_SIZE = 18,
  GLOVE_CONFIGURATION_SIZE = 9 + 9 + 9 + 7 + 7,
  GLOVE_HID_DESCRIPTOR_AT = 9 + 9,
  GLOVE_HID_DESCRIPTOR_SIZE = 9,
  GLOVE_REPORT_DESCRIPTOR_SIZE = 39,
  GLOVE_IN_ENDPOINT = 1,
  GLOVE_OUT_ENDPOINT = 2,
  GLOVE_STRING_MANUFACTURER = 1,
  GLOVE_STRING_PRODUCT = 2,
  GLOVE_STRING_SERIAL = 3,
};

extern const uint8_t glove_device_descriptor[GLOVE_DEVICE_DESCRIPTOR_SIZE] PROGMEM;
extern const uint8_t glove_configuration[GLOVE_CONFIGURATION_SIZE] PROGMEM;
extern const uint8_t glove_hid_report_descriptor[GLOVE_REPORT_DESCRIPTOR_SIZE] PROGMEM;
extern const char glove_manufacturer[] PROGMEM;
extern const char glove_product[] PROGMEM;

#ifdef __cplusplus
}
#endif
#endif
