/* A USB HID device on the ATmega32U4's own controller (data sheet ATmega16U4/32U4, chapters 21 and 22),
 * polled: no interrupts, no buffers beyond one report. */
#ifndef HANDLOFT_GLOVE_USB_H
#define HANDLOFT_GLOVE_USB_H

#include <stdbool.h>
#include <stdint.h>

/* What the device does with reports. */
typedef struct {
  /* Fills a report for the computer, its id in front; its size, or 0 for one that there is not. */
  uint8_t (*get_report)(uint8_t type, uint8_t id, uint8_t* into);
  /* Takes a report, its id in front. False: it is refused. */
  bool (*set_report)(uint8_t type, const uint8_t* report, uint8_t size);
} usb_hid_handlers;

enum { USB_REPORT_INPUT = 1, USB_REPORT_OUTPUT = 2, USB_REPORT_FEATURE = 3 };

/* Detaches from whatever the bootloader was to the computer, and attaches anew. Waits some 20 ms. */
void usb_begin(const usb_hid_handlers* handlers);
/* Answers the computer; to be called at least every 10 ms. */
void usb_poll(void);
/* The computer has chosen the configuration and has not put the bus to sleep. */
bool usb_is_ready(void);
/* False: the computer has not fetched the reports before it. */
bool usb_send_report(const uint8_t* report, uint8_t size);

#endif
