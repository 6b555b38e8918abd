"""(6) May we show this? Measures, verdict, reasons and advice."""
