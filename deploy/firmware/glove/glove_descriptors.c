#include "glove_descriptors.h"

#include "glove_logic.h"

#define LOW(value) ((uint8_t)((value) & 0xFF))
#define HIGH(value) ((uint8_t)((value) >> 8))

/* pid.codes' numbers for devices that stay in the laboratory. */
#define VENDOR 0x1209
#define PRODUCT 0x0001

const uint8_t glove_device_descriptor[GLOVE_DEVICE_DESCRIPTOR_SIZE] PROGMEM = {
    GLOVE_DEVICE_DESCRIPTOR_SIZE, 1, /* DEVICE */
    0x00, 0x02,                      /* USB 2.0 */
    0, 0, 0,                         /* The interface tells its class */
    GLOVE_ENDPOINT_0_SIZE,
    LOW(VENDOR), HIGH(VENDOR), LOW(PRODUCT), HIGH(PRODUCT),
    0x00, 0x01,                      /* Firmware 1.00 */
    GLOVE_STRING_MANUFACTURER, GLOVE_STRING_PRODUCT, GLOVE_STRING_SERIAL,
    1,                               /* Configuration */
};

const uint8_t glove_configuration[GLOVE_CONFIGURATION_SIZE] PROGMEM = {
    9, 2, LOW(GLOVE_CONFIGURATION_SIZE), HIGH(GLOVE_CONFIGURATION_SIZE), 1, 1, 0,
    0x80, 100,                       /* Powered by the bus, 200 mA: light 60, motor 80, board 30 */
    9, 4, 0, 0, 2, 3, 0, 0, 0,       /* Interface 0: HID, two endpoints, no boot protocol */
    9, 0x21, 0x11, 0x01, 0, 1, 0x22, LOW(GLOVE_REPORT_DESCRIPTOR_SIZE), HIGH(GLOVE_REPORT_DESCRIPTOR_SIZE),
    7, 5, 0x80 | GLOVE_IN_ENDPOINT, 3, 64, 0, 1, /* Interrupt in, asked every ms */
    7, 5, GLOVE_OUT_ENDPOINT, 3, 64, 0, 4,       /* Interrupt out */
};

const uint8_t glove_hid_report_descriptor[GLOVE_REPORT_DESCRIPTOR_SIZE] PROGMEM = {
    0x06, 0x4C, 0xFF,                          /* Usage Page (vendor-defined 0xFF4C) */
    0x09, 0x01,                                /* Usage (1: glove) */
    0xA1, 0x01,                                /* Collection (Application) */
    0x15, 0x00,                                /*   Logical Minimum (0) */
    0x26, 0xFF, 0x00,                          /*   Logical Maximum (255) */
    0x75, 0x08,                                /*   Report Size (8 bits) */
    0x85, GLOVE_REPORT_ID,                     /*   Report ID; each count is without the id */
    0x95, GLOVE_REPORT_SIZE - 1, 0x09, 0x02,   /*   Report Count, Usage (2: state) */
    0x81, 0x02,                                /*   Input (Data, Variable, Absolute) */
    0x85, GLOVE_OUTPUT_ID,
    0x95, GLOVE_OUTPUT_SIZE - 1, 0x09, 0x03,   /*   Usage (3: light and vibration) */
    0x91, 0x02,                                /*   Output */
    0x85, GLOVE_RANGE_ID,
    0x95, GLOVE_RANGE_SIZE - 1, 0x09, 0x04,    /*   Usage (4: range) */
    0xB1, 0x02,                                /*   Feature */
    0xC0,                                      /* End Collection */
};

const char glove_manufacturer[] PROGMEM = "Handloft";
const char glove_product[] PROGMEM = "Handloft Glove";
