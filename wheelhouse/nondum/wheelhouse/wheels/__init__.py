"""What is inside a wheel, judged before anything is unpacked."""
