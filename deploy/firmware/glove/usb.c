#include "usb.h"

#include <avr/boot.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <util/delay.h>

#include "glove_descriptors.h"
#include "glove_logic.h"

/* Chapter 9 and HID 1.11 section 7.2. */
enum {
  GET_STATUS = 0,
  CLEAR_FEATURE = 1,
  SET_FEATURE = 3,
  SET_ADDRESS = 5,
  GET_DESCRIPTOR = 6,
  GET_CONFIGURATION = 8
};
enum { SET_CONFIGURATION = 9, GET_INTERFACE = 10, SET_INTERFACE = 11 };
enum { HID_GET_REPORT = 1, HID_GET_IDLE = 2, HID_GET_PROTOCOL = 3, HID_SET_REPORT = 9, HID_SET_IDLE = 10 };
enum { HID_SET_PROTOCOL = 11 };
enum { DESCRIPTOR_DEVICE = 1, DESCRIPTOR_CONFIGURATION = 2, DESCRIPTOR_STRING = 3, DESCRIPTOR_HID = 0x21 };
enum { DESCRIPTOR_REPORT = 0x22 };
enum { TO_HOST = 0x80, TYPE_MASK = 0x60, TYPE_CLASS = 0x20, RECIPIENT_MASK = 0x1F, RECIPIENT_ENDPOINT = 2 };

/* Endpoint set-up, tables in section 22.18: 64 bytes, allocated. */
enum {
  ONE_BANK_64 = (3 << EPSIZE0) | (1 << ALLOC),
  TWO_BANKS_64 = (3 << EPSIZE0) | (1 << EPBK0) | (1 << ALLOC)
};
enum { TYPE_INTERRUPT = 3 << EPTYPE0 };
enum {
  SERIAL_FIRST = 0x0E,
  SERIAL_BYTES = 10
};                           /* The chip's lot, wafer and place on it, in its signature row. */
enum { WAIT_LIMIT = 50000 }; /* Turns of a wait, some 30 ms: a computer that goes meanwhile. */

typedef struct {
  uint8_t type, request;
  uint16_t value, index, length;
} setup_packet;

static const usb_hid_handlers* handlers;
static uint8_t configuration;
static bool asleep;
static uint8_t idle_rate;

static void select_endpoint(uint8_t endpoint) {
  UENUM = endpoint;
}

static void stall(void) {
  UECONX = (1 << STALLRQ) | (1 << EPEN);
}

/* Waits until the control endpoint's bank is free for us. False: the computer ended the transfer, or went. */
static bool wait_for_bank(void) {
  for (uint16_t i = 0; i < WAIT_LIMIT; ++i) {
    if (UEINTX & (1 << RXSTPI)) return false;
    if (UEINTX & (1 << RXOUTI)) return false;
    if (UEINTX & (1 << TXINI)) return true;
    if (UDINT & (1 << EORSTI)) return false;
  }
  return false;
}

static void acknowledge(void) {
  UEINTX = (uint8_t) ~(1 << TXINI);
}

/* Where bytes of an answer come from. */
typedef uint8_t (*byte_at)(const void* from, uint16_t at);

static uint8_t byte_in_flash(const void* from, uint16_t at) {
  return pgm_read_byte((const uint8_t*)from + at);
}
static uint8_t byte_in_ram(const void* from, uint16_t at) {
  return ((const uint8_t*)from)[at];
}

static void answer(const void* from, uint16_t size, uint16_t asked, byte_at read) {
  const uint16_t total = size < asked ? size : asked;
  uint16_t sent = 0;
  bool last_was_full;
  do {
    if (!wait_for_bank()) return;
    uint8_t in_packet = 0;
    for (; in_packet < GLOVE_ENDPOINT_0_SIZE && sent < total; ++in_packet, ++sent) UEDATX = read(from, sent);
    acknowledge();
    last_was_full = in_packet == GLOVE_ENDPOINT_0_SIZE;
    /* A full last packet that is less than was asked for is followed by an empty one. */
  } while (sent < total || (last_was_full && total < asked));
}

/* Strings are ASCII in flash, told as UTF-16. */
static uint8_t byte_of_string(const void* from, uint16_t at) {
  const char* text = from;
  if (at == 0) return (uint8_t)(2 + 2 * strlen_P(text));
  if (at == 1) return DESCRIPTOR_STRING;
  return at % 2 == 0 ? pgm_read_byte(text + (at - 2) / 2) : 0;
}

static uint8_t byte_of_serial(const void* from, uint16_t at) {
  (void)from;
  if (at == 0) return 2 + 2 * 2 * SERIAL_BYTES;
  if (at == 1) return DESCRIPTOR_STRING;
  if (at % 2 != 0) return 0;
  const uint8_t digit = (uint8_t)((at - 2) / 2);
  const uint8_t saved = SREG;
  cli();
  const uint8_t byte = boot_signature_byte_get((uint16_t)(SERIAL_FIRST + digit / 2));
  SREG = saved;
  const uint8_t half = digit % 2 == 0 ? byte >> 4 : byte & 15;
  return (uint8_t)(half < 10 ? '0' + half : 'A' + half - 10);
}

static const uint8_t languages[] PROGMEM = {4, DESCRIPTOR_STRING, 0x09, 0x04};

static void get_descriptor(const setup_packet* setup) {
  const uint8_t kind = (uint8_t)(setup->value >> 8), number = (uint8_t)setup->value;
  switch (kind) {
    case DESCRIPTOR_DEVICE:
      answer(glove_device_descriptor, sizeof glove_device_descriptor, setup->length, byte_in_flash);
      return;
    case DESCRIPTOR_CONFIGURATION:
      answer(glove_configuration, sizeof glove_configuration, setup->length, byte_in_flash);
      return;
    case DESCRIPTOR_HID:
      answer(glove_configuration + GLOVE_HID_DESCRIPTOR_AT, GLOVE_HID_DESCRIPTOR_SIZE, setup->length,
             byte_in_flash);
      return;
    case DESCRIPTOR_REPORT:
      answer(glove_hid_report_descriptor, sizeof glove_hid_report_descriptor, setup->length, byte_in_flash);
      return;
    case DESCRIPTOR_STRING:
      if (number == 0) {
        answer(languages, sizeof languages, setup->length, byte_in_flash);
      } else if (number == GLOVE_STRING_MANUFACTURER || number == GLOVE_STRING_PRODUCT) {
        const char* text = number == GLOVE_STRING_PRODUCT ? glove_product : glove_manufacturer;
        answer(text, (uint16_t)(2 + 2 * strlen_P(text)), setup->length, byte_of_string);
      } else if (number == GLOVE_STRING_SERIAL) {
        answer(0, 2 + 2 * 2 * SERIAL_BYTES, setup->length, byte_of_serial);
      } else {
        stall();
      }
      return;
    default:
      stall();
  }
}

static void configure_endpoints(void) {
  select_endpoint(GLOVE_IN_ENDPOINT);
  UECONX = 1 << EPEN;
  UECFG0X = TYPE_INTERRUPT | (1 << EPDIR);
  UECFG1X = TWO_BANKS_64;
  select_endpoint(GLOVE_OUT_ENDPOINT);
  UECONX = 1 << EPEN;
  UECFG0X = TYPE_INTERRUPT;
  UECFG1X = ONE_BANK_64;
  UERST = (1 << GLOVE_IN_ENDPOINT) | (1 << GLOVE_OUT_ENDPOINT);
  UERST = 0;
  select_endpoint(0);
}

/* The data stage of a SET_REPORT; at most one packet, no report of ours is longer. */
static void set_report(const setup_packet* setup) {
  uint8_t report[GLOVE_ENDPOINT_0_SIZE];
  if (setup->length == 0 || setup->length > sizeof report) {
    stall();
    return;
  }
  uint16_t i = 0;
  while (!(UEINTX & (1 << RXOUTI))) {
    if (++i == WAIT_LIMIT || (UEINTX & (1 << RXSTPI)) || (UDINT & (1 << EORSTI))) return;
  }
  const uint8_t size = UEBCLX < setup->length ? UEBCLX : (uint8_t)setup->length;
  for (uint8_t at = 0; at < size; ++at) report[at] = UEDATX;
  UEINTX = (uint8_t) ~(1 << RXOUTI);
  if (handlers->set_report((uint8_t)(setup->value >> 8), report, size)) {
    acknowledge();
  } else {
    stall();
  }
}

static void handle_class(const setup_packet* setup) {
  switch (setup->request) {
    case HID_GET_REPORT: {
      uint8_t report[GLOVE_REPORT_SIZE];
      const uint8_t size = handlers->get_report((uint8_t)(setup->value >> 8), (uint8_t)setup->value, report);
      if (size == 0) {
        stall();
      } else {
        answer(report, size, setup->length, byte_in_ram);
      }
      return;
    }
    case HID_SET_REPORT:
      set_report(setup);
      return;
    case HID_GET_IDLE:
      answer(&idle_rate, 1, setup->length, byte_in_ram);
      return;
    case HID_SET_IDLE:
      idle_rate = (uint8_t)(setup->value >> 8); /* Told when asked; a glove reports all the time. */
      acknowledge();
      return;
    default: /* There is no boot protocol. */
      stall();
  }
}

static void handle_standard(const setup_packet* setup) {
  static const uint8_t zeros[2] PROGMEM = {0, 0};
  const uint8_t recipient = setup->type & RECIPIENT_MASK;
  switch (setup->request) {
    case GET_STATUS:
      answer(zeros, 2, setup->length, byte_in_flash);
      return;
    case SET_ADDRESS:
      UDADDR = (uint8_t)(setup->value & 0x7F);
      acknowledge();
      /* The new address counts once the computer has seen the acknowledgement under the old one. */
      wait_for_bank();
      UDADDR |= 1 << ADDEN;
      return;
    case GET_DESCRIPTOR:
      get_descriptor(setup);
      return;
    case GET_CONFIGURATION:
      answer(&configuration, 1, setup->length, byte_in_ram);
      return;
    case SET_CONFIGURATION:
      if (setup->value > 1) {
        stall();
        return;
      }
      configuration = (uint8_t)setup->value;
      acknowledge();
      if (configuration != 0) configure_endpoints();
      return;
    case GET_INTERFACE:
      answer(zeros, 1, setup->length, byte_in_flash);
      return;
    case SET_INTERFACE:
      if (setup->value == 0) {
        acknowledge();
      } else {
        stall();
      }
      return;
    case CLEAR_FEATURE:
      if (recipient == RECIPIENT_ENDPOINT) {
        const uint8_t endpoint = setup->index & 0x0F;
        if (endpoint == GLOVE_IN_ENDPOINT || endpoint == GLOVE_OUT_ENDPOINT) {
          select_endpoint(endpoint);
          UECONX = (1 << STALLRQC) | (1 << RSTDT) | (1 << EPEN);
          select_endpoint(0);
        }
      }
      acknowledge();
      return;
    default:
      stall();
  }
}

static void handle_setup(void) {
  setup_packet setup;
  setup.type = UEDATX;
  setup.request = UEDATX;
  setup.value = UEDATX;
  setup.value |= (uint16_t)((uint16_t)UEDATX << 8);
  setup.index = UEDATX;
  setup.index |= (uint16_t)((uint16_t)UEDATX << 8);
  setup.length = UEDATX;
  setup.length |= (uint16_t)((uint16_t)UEDATX << 8);
  UEINTX = (uint8_t) ~((1 << RXSTPI) | (1 << RXOUTI) | (1 << TXINI));
  if ((setup.type & TYPE_MASK) == TYPE_CLASS) {
    handle_class(&setup);
  } else if ((setup.type & TYPE_MASK) == 0) {
    handle_standard(&setup);
  } else {
    stall();
  }
}

static void take_output(void) {
  select_endpoint(GLOVE_OUT_ENDPOINT);
  if (UEINTX & (1 << RXOUTI)) {
    UEINTX = (uint8_t) ~(1 << RXOUTI);
    uint8_t report[GLOVE_ENDPOINT_0_SIZE];
    const uint8_t size = UEBCLX < sizeof report ? UEBCLX : (uint8_t)sizeof report;
    for (uint8_t at = 0; at < size; ++at) report[at] = UEDATX;
    UEINTX = (uint8_t) ~(1 << FIFOCON);
    /* Nobody hears a refusal here. */
    handlers->set_report(USB_REPORT_OUTPUT, report, size);
  }
  select_endpoint(0);
}

void usb_begin(const usb_hid_handlers* given) {
  handlers = given;
  configuration = 0;
  asleep = false;
  USBCON = 0;
  UHWCON = 1 << UVREGE;
  USBCON = (1 << USBE) | (1 << FRZCLK);
#if F_CPU == 16000000UL
  PLLCSR = 1 << PINDIV;
  PLLCSR = (1 << PINDIV) | (1 << PLLE);
#elif F_CPU == 8000000UL
  PLLCSR = 1 << PLLE;
#else
#error "The USB controller's clock comes from a crystal of 8 or 16 MHz"
#endif
  while (!(PLLCSR & (1 << PLOCK))) {
  }
  USBCON = (1 << USBE) | (1 << OTGPADE);
  /* Long enough for the computer to see that the bootloader went. */
  UDCON = 1 << DETACH;
  _delay_ms(20);
  UDCON = 0; /* Full speed, attached. */
}

void usb_poll(void) {
  const uint8_t events = UDINT;
  if (events & (1 << EORSTI)) {
    UDINT = (uint8_t) ~(1 << EORSTI);
    configuration = 0;
    asleep = false;
    select_endpoint(0);
    UECONX = 1 << EPEN;
    UECFG0X = 0; /* Control. */
    UECFG1X = ONE_BANK_64;
  }
  if (events & (1 << WAKEUPI)) {
    UDINT = (uint8_t) ~(1 << WAKEUPI);
    asleep = false;
  }
  if (events & (1 << SUSPI)) {
    UDINT = (uint8_t) ~(1 << SUSPI);
    asleep = true;
  }
  if (events & (1 << SOFI)) {
    UDINT = (uint8_t) ~(1 << SOFI);
    asleep = false;
  }
  select_endpoint(0);
  if (UEINTX & (1 << RXSTPI)) handle_setup();
  if (configuration != 0) take_output();
}

bool usb_is_ready(void) {
  return configuration != 0 && !asleep;
}

bool usb_send_report(const uint8_t* report, uint8_t size) {
  select_endpoint(GLOVE_IN_ENDPOINT);
  const bool is_free = (UEINTX & (1 << TXINI)) != 0;
  if (is_free) {
    UEINTX = (uint8_t) ~(1 << TXINI);
    for (uint8_t at = 0; at < size; ++at) UEDATX = report[at];
    UEINTX = (uint8_t) ~(1 << FIFOCON);
  }
  select_endpoint(0);
  return is_free;
}
