"""What is plugged in: drives and devices, as udev, the kernel or slot folders tell of them."""
