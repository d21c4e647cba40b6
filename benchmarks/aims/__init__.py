"""What the benchmarks are to show, beside what they have shown."""
