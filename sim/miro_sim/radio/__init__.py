"""The radio between the PC and the robots: 9600 baud down to every robot of a network, a second band up."""
