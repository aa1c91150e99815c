"""Steps in closed form that several effects share: a lag, a delay, the age of a contact, an elastic link."""
